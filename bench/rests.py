#!/usr/bin/env python3
"""Measures what guides gain that may rest: the tables of README.md and of docs/host.md.

usage: bench/rests.py DIRECTORY_OF_PROGRAMS OUT.json cpu|gpu FOLDER_OF_GLTF

Four seeds render each scene with and without a guide. A variance is half of the mean difference of two seeds' pictures. OUT.json
keeps the other device's part.
"""
import json
import os
import statistics
import sys
import tempfile

from programs import Programs, write_results

BUILT_IN = {"ajar": "", "cornell-box": "", "cornell-enclosed": "--nee off", "furnace": "", "glossy-room": "--nee off",
            "materials": "", "outdoor": "", "thin-wall": "--max-depth 6"}
FILES = {"bathroom.glb": "", "cornell-box.glb": "", "staircase2.glb": "", "veach-ajar.glb": "", "veach-mis.glb": "--light-groups 1"}
ON_CPUS_ALONE = ("cornell-enclosed", "furnace", "glossy-room", "thin-wall")
DEVICES = {"cpu": ("seq", "256x256"), "gpu": ("cuda", "1920x1080")}
PAIRS = ((1, 2), (3, 4))


def half_difference(programs, method):
    """Variance of a method's pictures."""
    errors = [programs.compare(f"{method}{a}", f"{method}{b}")["mse_reinhard"] for a, b in PAIRS]
    return statistics.mean(errors) / 2


def seconds(stats):
    """A rendering's time, without what stands before all methods."""
    return stats["seconds"]["total"] - stats["seconds"].get("embree", 0.0) - stats["seconds"].get("bvh", 0.0)


def measure(programs, scene, options, samples):
    """Gain, time and rests of a scene at a number of samples."""
    seeds = [seed for pair in PAIRS for seed in pair]
    times = {"pt": [], "wfpg": []}
    rested = []
    for seed in seeds:
        for method in times:
            own = [] if method == "pt" and "light-groups" in options else options.split()
            stats = programs.render(scene, f"{method}{seed}", ["--spp", samples, "--seed", str(seed), "--method", method, *own])
            times[method].append(seconds(stats))
            if method == "wfpg":
                rested.append(stats["rest"]["samples"])
    gain = half_difference(programs, "pt") / half_difference(programs, "wfpg")
    time = statistics.mean(times["wfpg"]) / statistics.mean(times["pt"])
    return {"gain": round(gain, 3), "time": round(time, 3), "equal_time": round(gain / time, 3),
            "seconds_pt": round(statistics.mean(times["pt"]), 2), "rested": rested}


def main(directory, out, device, folder):
    results = {}
    if os.path.exists(out):
        with open(out) as file:
            results = json.load(file)
    kind, size = DEVICES[device]
    scenes = {}
    with tempfile.TemporaryDirectory() as pictures:
        programs = Programs(directory, size, pictures, kind)
        for name, options in {**BUILT_IN, **FILES}.items():
            if device == "gpu" and name in ON_CPUS_ALONE:
                continue
            print(name, file=sys.stderr)
            path = os.path.join(folder, name) if name in FILES else name
            scenes[name] = {samples: measure(programs, path, options, samples) for samples in ("16", "64")}
    results[device] = {"device": kind, "size": size, "scenes": scenes}
    write_results(out, results, device)


if __name__ == "__main__":
    if len(sys.argv) != 5 or sys.argv[3] not in DEVICES:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
