#!/usr/bin/env python3
"""Times a guided sample beside a path-traced one on the GPU, and writes results for bench/table.py.

usage: bench/sample_times.py DIRECTORY_OF_PROGRAMS OUT.json [RUNS [SIZE]]

A run renders each scene with each method twice, with 32 and 128 samples. The difference is the time of samples after
warm-up. Ratios are taken within one run, and are medians over RUNS (20) runs.
"""
import statistics
import sys
import tempfile

from programs import Programs, medians, milliseconds_a_sample, write_results

SCENES = ("ajar",)
METHODS = {"pt": ["--method", "pt"], "wfpg": []}
FIRST, LAST = 32, 128
# The stages of a rendering that every sample has.
STAGES = ("camera", "update", "trace", "sort", "lights", "directions", "shade", "film")


def warmed_up(programs, scene, arguments):
    """Milliseconds by stage and segments of one sample after warm-up."""
    first, last = (programs.render(scene, "x", ["--spp", str(n), *arguments]) for n in (FIRST, LAST))
    samples = LAST - FIRST
    return {**milliseconds_a_sample(first, last, samples, STAGES), "segments": (last["segments"] - first["segments"]) / samples}


def measure(programs, scene, runs):
    methods = {name: [] for name in METHODS}
    for _ in range(runs + 1):  # the first warms up
        for name, arguments in METHODS.items():
            methods[name].append(warmed_up(programs, scene, arguments))
    pairs = list(zip(methods["pt"], methods["wfpg"]))[1:]
    by_sample = [w["total"] / p["total"] for p, w in pairs]
    by_segment = [w["total"] / w["segments"] / (p["total"] / p["segments"]) for p, w in pairs]
    milliseconds = {name: medians(lines[1:]) for name, lines in methods.items()}
    return {"scene": scene, "milliseconds": milliseconds, "ratio_a_sample": statistics.median(by_sample),
            "ratio_a_segment": statistics.median(by_segment), "ratios_a_segment": sorted(by_segment)}


def main(directory, out, runs="20", size="1920x1080"):
    settled_samples = []
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(directory, size, folder)
        for scene in SCENES:
            print(scene, file=sys.stderr)
            settled_samples.append(measure(programs, scene, int(runs)))
    write_results(out, {"runs": int(runs), "size": size, "settled_samples": settled_samples})


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 5:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
