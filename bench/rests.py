#!/usr/bin/env python3
"""Measures what guides gain that may rest: the tables of README.md and of docs/host.md.

usage: bench/rests.py DIRECTORY_OF_PROGRAMS OUT.json cpu|gpu FOLDER_OF_GLTF

Four seeds render each scene with and without a guide. A variance is half of the mean difference of two seeds' pictures. On CPUs
renderings have one thread, and two cores fewer than there are have a scene each. OUT.json keeps the other device's part.
"""
import concurrent.futures
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


def measure_scene(directory, device, scene, options):
    """What measure() finds, by number of samples."""
    kind, size = DEVICES[device]
    with tempfile.TemporaryDirectory() as pictures:
        programs = Programs(directory, size, pictures, kind)
        found = {samples: measure(programs, scene, options, samples) for samples in ("16", "64")}
    print(os.path.basename(scene), {samples: line["equal_time"] for samples, line in found.items()}, file=sys.stderr, flush=True)
    return found


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
    chosen = {name: options for name, options in {**BUILT_IN, **FILES}.items() if device == "cpu" or name not in ON_CPUS_ALONE}
    at_once = max(1, len(os.sched_getaffinity(0)) - 2) if device == "cpu" else 1
    with concurrent.futures.ThreadPoolExecutor(at_once) as threads:
        paths = {name: os.path.join(folder, name) if name in FILES else name for name in chosen}
        found = {name: threads.submit(measure_scene, directory, device, paths[name], options) for name, options in chosen.items()}
        scenes = {name: future.result() for name, future in found.items()}
    results[device] = {"device": kind, "size": size, "scenes_at_once": min(at_once, len(scenes)), "scenes": scenes}
    write_results(out, results, device)


if __name__ == "__main__":
    if len(sys.argv) != 5 or sys.argv[3] not in DEVICES:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
