#!/usr/bin/env python3
"""Measures what guides cost where they have little to gain: the table of single-threaded pairs of docs/host.md.

usage: bench/pairs.py DIRECTORY_OF_PROGRAMS OUT.json SAMPLES FOLDER_OF_GLTF [SCENE...]

Path tracing and both guided methods render each scene one after the other, 21 times with other seeds and in turned order. Each
rendering has one thread and a core of its own; two run at once. A ratio of times is a median, with an interval that holds it with
more than 95% probability. Equal time is the gain over that. A variance is half of the mean difference of two seeds' pictures. Let the
machine idle else. OUT.json is written after each scene, and keeps other scenes and numbers of samples.
"""
import concurrent.futures
import os
import statistics
import sys
import tempfile

from programs import Programs, begin_results, seconds, unguided_options, write_results

SCENES = {"cornell-box": "", "staircase2.glb": "", "veach-mis.glb": "--light-groups 1", "materials": "", "outdoor": "", "furnace": ""}
METHODS = ("pt", "wfpg", "wfpg-product")
ROUNDS = 21
INTERVAL = (5, 15)  # of 21 sorted values: one below or above has a probability of 1.3% each
SIZE = "256x256"


def render_round(programs, scene, options, samples, number, core):
    """Renders a seed by all methods on one core. Returns their statistics."""
    os.sched_setaffinity(0, {core})  # of this thread, and of the programs that it starts
    found = {}
    for method in METHODS if number % 2 == 0 else reversed(METHODS):
        own = unguided_options(options) if method == "pt" else options
        found[method] = programs.render(scene, f"{method}{number}", ["--spp", samples, "--seed", str(number + 1), "--method", method, *own])
    return found


def variance(programs, method):
    """Of a method's pictures, whose seeds are compared with the next one's."""
    differences = [programs.compare(f"{method}{n}", f"{method}{n + 1}")["mse_reinhard"] for n in range(ROUNDS - 1)]
    return statistics.mean(differences) / 2


def with_interval(values):
    """The median, and the ends of the interval that holds it."""
    ordered = sorted(values)
    return [round(value, 3) for value in (statistics.median(ordered), *(ordered[i] for i in INTERVAL))]


def measure(programs, scene, options, samples, cores):
    """Times over path tracing's, gains, and samples that rested, of both guided methods."""
    rounds = []
    for first in range(0, ROUNDS, len(cores)):
        numbers = range(first, min(first + len(cores), ROUNDS))
        with concurrent.futures.ThreadPoolExecutor(len(cores)) as threads:
            rounds += threads.map(lambda n: render_round(programs, scene, options, samples, n, cores[n % len(cores)]), numbers)
        print(f"{os.path.basename(scene)}, {samples} samples: {len(rounds)} of {ROUNDS}", file=sys.stderr, flush=True)
    cell = {"seconds_pt": round(statistics.median(seconds(found["pt"]) for found in rounds), 2)}
    unguided = variance(programs, "pt")
    for method in METHODS[1:]:
        gain = unguided / variance(programs, method)
        times = [seconds(found[method]) / seconds(found["pt"]) for found in rounds]
        cell[method] = {"gain": round(gain, 3), "time": with_interval(times), "equal_time": with_interval(gain / t for t in times),
                        "rested": round(statistics.mean(found[method]["rest"]["samples"] for found in rounds), 1)}
    return cell


def main(directory, out, samples, folder, *names):
    results = begin_results(out)
    cores = sorted(os.sched_getaffinity(0))[:2]
    scenes = results.setdefault(samples, {"size": SIZE, "rounds": ROUNDS, "scenes": {}})["scenes"]
    for name in names or SCENES:
        with tempfile.TemporaryDirectory() as pictures:
            programs = Programs(directory, SIZE, pictures, "seq")
            scene = os.path.join(folder, name) if name.endswith(".glb") else name
            scenes[name] = measure(programs, scene, SCENES[name].split(), samples, cores)
        write_results(out, results, samples)


if __name__ == "__main__":
    if len(sys.argv) < 5 or not sys.argv[3].isdigit() or not set(sys.argv[5:]) <= set(SCENES):
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
