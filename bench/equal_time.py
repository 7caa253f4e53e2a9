#!/usr/bin/env python3
"""Compares methods on the GPU at equal time, and writes results for bench/table.py.

usage: bench/equal_time.py DIRECTORY_OF_PROGRAMS OUT.json [SECONDS [REFERENCE_SECONDS [SIZE]]]

Renders each scene with each method for SECONDS (10). Two references take REFERENCE_SECONDS (60) each and have other
seeds. One is path traced and one guided, so that neither method is favoured. An error is the mean against both, less
half the difference between the references, which is their own noise.
"""
import sys
import tempfile

from programs import ERRORS, Programs, errors_without_noise, is_hidden, write_results

SCENES = {"cornell-enclosed": "off", "ajar": "on"}  # and next-event estimation
METHODS = {
    "pt": ["--method", "pt"],
    "transient": ["--fields", "transient"],
    "wfpg": [],
    "product": ["--method", "wfpg-product"],
}
REFERENCES = {"a": (["--method", "pt"], 901), "b": ([], 902)}


def summary(stats, errors, noise):
    """One method's line: errors without the references' noise, and what a sample took."""
    spp = stats["spp"]
    line = {"spp": spp, **errors_without_noise(errors, noise)}
    line["milliseconds_a_sample"] = {stage: 1e3 * s / spp for stage, s in stats["seconds"].items()}
    line["segments_a_sample"] = stats["segments"] / spp
    line["persistent_bytes"] = stats["memory"]["persistent"]
    line["transient_bytes"] = stats["memory"]["transient"]
    return line


def measure(programs, scene, seconds, reference_seconds):
    def render(name, arguments, seconds, seed):
        budget = ["--nee", SCENES[scene], "--seconds", str(seconds), "--seed", str(seed)]
        return programs.render(scene, name, budget + arguments)

    for name, (arguments, seed) in REFERENCES.items():
        render(name, arguments, reference_seconds, seed)
    noise = programs.compare("a", "b")
    methods = {}
    for name, arguments in METHODS.items():
        stats = render(name, arguments, seconds, 1)
        methods[name] = summary(stats, [programs.compare(name, reference) for reference in REFERENCES], noise)
    for line in methods.values():
        # None if the references' noise hides the method's error.
        line["ratios"] = {
            e: None if is_hidden(line[e], noise[e]) else methods["pt"][e] / line[e] for e in ERRORS
        }
    return {"scene": scene, "reference_noise": noise, "methods": methods}


def main(directory, out, seconds=10.0, reference_seconds=60.0, size="1920x1080"):
    scenes = []
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(directory, size, folder)
        for scene in SCENES:
            print(scene, file=sys.stderr)
            scenes.append(measure(programs, scene, float(seconds), float(reference_seconds)))
    write_results(out, {"seconds": float(seconds), "reference_seconds": float(reference_seconds), "size": size,
                        "scenes": scenes})


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 6:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
