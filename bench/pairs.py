#!/usr/bin/env python3
"""Measures what guides cost and gain on single threads: the tables of pairs of docs/host.md.

Path tracing and guided methods render each scene one after the other, 21 times with other seeds and in turned order. Each
rendering has one thread and a core. As many seeds run at once as there are --cores. They share the machine's load: intervals
are right for two, and too narrow for many. A variance is half of the mean difference of two seeds' pictures. Let the machine idle
else. OUT.json is written after each scene, and keeps other scenes and numbers of samples.

A ratio of times is a median, with an interval that holds it with more than 95% probability. Equal time is the gain over that. Its
interval of 95% has the gain's error by leaving out one seed at a time, and the median's by drawing seeds anew.
"""
import argparse
import concurrent.futures
import math
import os
import random
import statistics
import sys
import tempfile

from programs import Programs, begin_results, seconds, unguided_options, write_results

# Those where a guide has little to gain, and those where it has much.
QUIET = {"cornell-box": "", "staircase2.glb": "", "veach-mis.glb": "--light-groups 1", "materials": "", "outdoor": "",
         "furnace": ""}
HARD = {"ajar": "", "bathroom.glb": "", "cornell-enclosed": "--nee off", "glossy-room": "--nee off", "thin-wall": "--max-depth 6",
        "veach-ajar.glb": ""}
SCENES = {**QUIET, **HARD}
GUIDED = ("wfpg", "wfpg-product")
ROUNDS = 21
INTERVAL = (5, 15)  # of 21 sorted values: one below or above has a probability of 1.3% each
REDRAWN = 4000  # sets of seeds
STUDENT = 2.09  # of 20 degrees of freedom: an interval of 95%, in standard errors
SIZE = "256x256"


def parsed_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", help="of wfpg-render and wfpg-compare")
    parser.add_argument("out", metavar="OUT.json")
    parser.add_argument("samples", type=int)
    parser.add_argument("folder", help="of .glb files")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="of " + ", ".join(SCENES) + f" (default: {', '.join(QUIET)})")
    parser.add_argument("--methods", default=",".join(GUIDED), help="guided ones (default: %(default)s)")
    parser.add_argument("--cores", type=int, default=2, help="renderings at once (default: %(default)s)")
    parser.add_argument("--older", metavar="DIRECTORY", help="of another wfpg-render, whose path tracing takes its turn, too")
    arguments = parser.parse_args()
    most = min(len(os.sched_getaffinity(0)), ROUNDS // 2 + 1)  # half of the rounds turn the order
    if not 1 <= arguments.cores <= most:
        parser.error(f"--cores is {arguments.cores}, expected 1 to {most}")
    if arguments.samples < 1:
        parser.error(f"samples is {arguments.samples}, expected at least 1")
    for given, known in ((arguments.scenes, SCENES), (arguments.methods.split(","), GUIDED)):
        if not set(given) <= set(known):
            parser.error(f"unknown: {', '.join(sorted(set(given) - set(known)))}; known are {', '.join(known)}")
    needed = [os.path.join(arguments.directory, program) for program in ("wfpg-render", "wfpg-compare")]
    needed += [os.path.join(arguments.older, "wfpg-render")] if arguments.older else []
    needed += [os.path.join(arguments.folder, scene) for scene in arguments.scenes or QUIET if scene.endswith(".glb")]
    for path in needed:
        if not os.path.exists(path):
            parser.error(f"there is no {path}")
    return arguments


def render_round(programs, scene, options, samples, number, cores):
    """Renders a seed by all methods on one core. `programs`: of each method. Returns their statistics."""
    os.sched_setaffinity(0, {cores[number % len(cores)]})  # of this thread, and of the programs that it starts
    found = {}
    for method in programs if number // len(cores) % 2 == 0 else reversed(programs):
        guides = method in GUIDED
        own = ["--method", method if guides else "pt", *(options if guides else unguided_options(options))]
        arguments = ["--spp", str(samples), "--seed", str(number + 1), *own]
        found[method] = programs[method].render(scene, f"{method}{number}", arguments)
    return found


def differences(programs, method):
    """Of each seed's picture and the next one's."""
    return [programs.compare(f"{method}{n}", f"{method}{n + 1}")["mse_reinhard"] for n in range(ROUNDS - 1)]


def require_equal_pictures(programs):
    """Of both path tracings: gains are over one's pictures, and times over the other's."""
    unequal = [n for n in range(ROUNDS) if programs.compare(f"pt{n}", f"older{n}")["mse_reinhard"] > 0]
    if unequal:
        sys.exit(f"pairs.py: the older program's pictures of {len(unequal)} seeds are others than today's")


def with_interval(values):
    """The median, and the ends of the interval that holds it."""
    ordered = sorted(values)
    return [round(value, 3) for value in (statistics.median(ordered), *(ordered[i] for i in INTERVAL))]


def gain_of(unguided, guided, without=None):
    """The ratio of mean differences, those of one seed left out."""
    kept = [i for i in range(len(guided)) if without is None or i not in (without - 1, without)]
    return sum(unguided[i] for i in kept) / sum(guided[i] for i in kept)


def equal_time(unguided, guided, times):
    """The gain over the median of times, and the ends of an interval of 95%."""
    logs = [math.log(gain_of(unguided, guided, seed)) for seed in range(ROUNDS)]
    of_gain = (ROUNDS - 1) * statistics.pvariance(logs)  # the jackknife's
    draw = random.Random(1)
    of_time = statistics.variance(math.log(statistics.median(draw.choices(times, k=ROUNDS))) for _ in range(REDRAWN))
    value, spread = gain_of(unguided, guided) / statistics.median(times), math.exp(STUDENT * math.sqrt(of_gain + of_time))
    return [round(value, 3), round(value / spread, 3), round(value * spread, 3)]


def measure(programs, scene, options, samples, cores):
    """Times over path tracing's, gains, and samples that rested, of guided methods. `programs`: of each method."""
    rounds = []
    for first in range(0, ROUNDS, len(cores)):
        numbers = range(first, min(first + len(cores), ROUNDS))
        with concurrent.futures.ThreadPoolExecutor(len(cores)) as threads:
            rounds += threads.map(lambda n: render_round(programs, scene, options, samples, n, cores), numbers)
        print(f"{os.path.basename(scene)}, {samples} samples: {len(rounds)} of {ROUNDS}", file=sys.stderr, flush=True)
    cell = {"cores": len(cores), "seconds_pt": round(statistics.median(seconds(found["pt"]) for found in rounds), 2)}
    unguided = differences(programs["pt"], "pt")
    for method in programs:
        times = {base: [seconds(found[method]) / seconds(found[base]) for found in rounds]
                 for base in programs if base not in GUIDED}
        if method == "older":
            require_equal_pictures(programs["pt"])
            cell[method] = {"time": with_interval(times["pt"])}
        if method not in GUIDED:
            continue
        guided = differences(programs[method], method)
        cell[method] = {"gain": round(gain_of(unguided, guided), 3), "time": with_interval(times["pt"]),
                        "equal_time": equal_time(unguided, guided, times["pt"]),
                        "rested": round(statistics.mean(found[method]["rest"]["samples"] for found in rounds), 1)}
        if "older" in times:
            cell[method]["equal_time_older"] = equal_time(unguided, guided, times["older"])
    return cell


def main(arguments):
    results = begin_results(arguments.out)
    cores = sorted(os.sched_getaffinity(0))[:arguments.cores]
    samples = str(arguments.samples)
    part = results.setdefault(samples, {"scenes": {}})
    part.update(size=SIZE, rounds=ROUNDS)
    for name in arguments.scenes or QUIET:
        with tempfile.TemporaryDirectory() as pictures:
            own = Programs(arguments.directory, SIZE, pictures, "seq")
            programs = {method: own for method in ("pt", *arguments.methods.split(","))}
            if arguments.older:
                programs["older"] = Programs(arguments.older, SIZE, pictures, "seq")
            scene = os.path.join(arguments.folder, name) if name.endswith(".glb") else name
            part["scenes"][name] = measure(programs, scene, SCENES[name].split(), samples, cores)
        write_results(arguments.out, results, samples)


if __name__ == "__main__":
    main(parsed_arguments())
