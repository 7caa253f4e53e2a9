#!/usr/bin/env python3
"""Times samples of methods with paths from lights on the GPU, stage by stage, and writes results for tools/publish.

usage: bench/light_times.py DIRECTORY_OF_PROGRAMS OUT.json [RUNS [SIZE]]

A run renders each scene with 2 and 8 samples. The difference is the time of samples alone. Times are medians over RUNS (3)
runs, after one that warms up.
"""
import sys
import tempfile

from programs import Programs, medians, milliseconds_a_sample, write_results

SAMPLES = {"caustic-pool": ("bpt", "vcm"), "mirror-balls": ("bpt", "vcm"), "veach-bidir": ("bpt", "vcm"), "fog-spot": ("upbp",),
           "glass-caustic-fog": ("upbp",), "bottles": ("upbp",), "wax": ("upbp",)}
FIRST, LAST = 2, 8
STAGES = ("light paths", "splats", "photon map", "camera", "trace", "connections", "merges", "shade", "film")


def a_sample(programs, scene, options):
    """Milliseconds of one sample, by stage."""
    first, last = (programs.render(scene, "x", [*options, "--spp", str(n)]) for n in (FIRST, LAST))
    return milliseconds_a_sample(first, last, LAST - FIRST, STAGES)


def median_sample(programs, scene, options, runs):
    """Likewise, medians over runs, after one that warms up."""
    return medians([a_sample(programs, scene, options) for _ in range(runs + 1)][1:])


def measure(programs, scene, method, runs):
    return {"scene": scene, "method": method, "milliseconds": median_sample(programs, scene, ["--method", method], runs)}


def main(directory, out, runs="3", size="1920x1080"):
    samples = []
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(directory, size, folder)
        for scene, methods in SAMPLES.items():
            for method in methods:
                print(scene, method, file=sys.stderr)
                samples.append(measure(programs, scene, method, int(runs)))
    write_results(out, {"runs": int(runs), "size": size, "samples": samples})


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 5:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
