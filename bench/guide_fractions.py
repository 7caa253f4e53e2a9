#!/usr/bin/env python3
"""Measures constant and learnt fractions of guided directions: the tables of docs/ablations.md.

usage: bench/guide_fractions.py DIRECTORY_OF_PROGRAMS OUT.json

Four seeds render each scene on one thread with each method, the methods in turn. A variance is half of the mean difference of every
two seeds' pictures. Seconds are the least of four. An interrupted run resumes after the scenes that OUT has.
"""
import itertools
import statistics
import sys
import tempfile

from programs import Programs, SEEDS, begin_results, write_results

SCENES = {"ajar": "", "thin-wall": "--max-depth 6", "glossy-room": "--nee off", "cornell-enclosed": "--nee off", "cornell-box": "",
          "outdoor": "", "materials": "", "furnace": ""}
FRACTIONS = ("0.5", "0.7", "0.9")


def methods():
    """Arguments by name."""
    guided = ["--least-gain", "0"]
    return {"pt": ["--method", "pt"], **{f: [*guided, "--guide-fraction", f] for f in FRACTIONS}, "learnt": guided}


def measure(programs, scene, options, samples):
    """Variance, seconds, gain and gain at equal time of each method."""
    seconds = {name: [] for name in methods()}
    for seed in SEEDS:
        for name, arguments in methods().items():
            stats = programs.render(scene, f"{name}-{seed}", ["--spp", samples, "--seed", str(seed), *options.split(), *arguments])
            seconds[name].append(stats["seconds"]["total"])
    lines = {}
    for name in methods():
        errors = [programs.compare(f"{name}-{a}", f"{name}-{b}")["mse_reinhard"] for a, b in itertools.combinations(SEEDS, 2)]
        lines[name] = {"variance": statistics.mean(errors) / 2, "seconds": round(min(seconds[name]), 3)}
    for line in lines.values():
        line["gain"] = round(lines["pt"]["variance"] / line["variance"], 3)
        line["equal_time"] = round(line["gain"] * lines["pt"]["seconds"] / line["seconds"], 3)
    return lines


def main(directory, out):
    scenes = begin_results(out).get("scenes", {})
    with tempfile.TemporaryDirectory() as pictures:
        programs = Programs(directory, "128x128", pictures, "seq")
        for name, options in SCENES.items():
            if name in scenes:
                print(f"{name}: {out} has it", file=sys.stderr)
                continue
            print(name, file=sys.stderr)
            scenes[name] = {samples: measure(programs, name, options, samples) for samples in ("16", "64")}
            write_results(out, {"scenes": scenes})


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
