#!/usr/bin/env python3
"""Measures what guides gain that may rest: the tables of README.md and of docs/host.md.

usage: bench/rests.py DIRECTORY_OF_PROGRAMS OUT.json cpu|gpu FOLDER_OF_GLTF

Four seeds render each scene with and without a guide. A variance is half of the mean difference of two seeds' pictures. Times are
medians of the seeds' ratios. On CPUs renderings have one thread, and two cores fewer than there are have a rendering each.
OUT.json keeps the other device's part.
"""
import concurrent.futures
import os
import statistics
import sys
import tempfile

from programs import SEEDS, Programs, begin_results, renderings_at_once, seconds, unguided_options, write_results

BUILT_IN = {"ajar": "", "cornell-box": "", "cornell-enclosed": "--nee off", "cornell-wall": "", "furnace": "", "glossy-room": "--nee off",
            "materials": "", "outdoor": "", "thin-wall": "--max-depth 6"}
FILES = {"bathroom.glb": "", "cornell-box.glb": "", "staircase2.glb": "", "veach-ajar.glb": "", "veach-mis.glb": "--light-groups 1"}
ON_CPUS_ALONE = ("cornell-enclosed", "cornell-wall", "furnace", "glossy-room", "thin-wall")
DEVICES = {"cpu": ("seq", "256x256"), "gpu": ("cuda", "1920x1080")}
METHODS = ("pt", "wfpg")


class Cell:
    """A scene at a number of samples: renderings of four seeds with and without a guide, in a folder of their own."""

    def __init__(self, directory, device, folder, scene, options, samples):
        self.scene, self.options, self.samples = scene, options.split(), samples
        kind, size = DEVICES[device]
        pictures = os.path.join(folder, os.path.basename(scene) + samples)
        os.makedirs(pictures)
        self.programs = Programs(directory, size, pictures, kind)
        self.statistics = {method: {} for method in METHODS}  # by seed

    def render(self, seed):
        """Renders a seed by both methods, one after the other."""
        for method in METHODS:
            own = unguided_options(self.options) if method == "pt" else self.options
            self.statistics[method][seed] = self.programs.render(
                self.scene, f"{method}{seed}", ["--spp", self.samples, "--seed", str(seed), "--method", method, *own])
        print(os.path.basename(self.scene), self.samples, seed, file=sys.stderr, flush=True)

    def result(self):
        """Gain, time and rests, once all seeds are rendered."""
        pt, wfpg = ([seconds(self.statistics[method][seed]) for seed in SEEDS] for method in METHODS)
        gain = self.programs.variance("pt") / self.programs.variance("wfpg")
        time = statistics.median(guided / unguided for guided, unguided in zip(wfpg, pt))
        return {"gain": round(gain, 3), "time": round(time, 3), "equal_time": round(gain / time, 3),
                "seconds_pt": round(statistics.median(pt), 2),
                "rested": [self.statistics["wfpg"][seed]["rest"]["samples"] for seed in SEEDS]}


def main(directory, out, device, folder):
    results = begin_results(out)
    kind, size = DEVICES[device]
    chosen = {name: options for name, options in {**FILES, **BUILT_IN}.items() if device == "cpu" or name not in ON_CPUS_ALONE}
    at_once = renderings_at_once() if device == "cpu" else 1
    with tempfile.TemporaryDirectory() as pictures:
        cells = {name: {samples: Cell(directory, device, pictures, os.path.join(folder, name) if name in FILES else name, options, samples)
                        for samples in ("64", "16")} for name, options in chosen.items()}
        with concurrent.futures.ThreadPoolExecutor(at_once) as threads:
            # The longest first.
            for done in [threads.submit(cell.render, seed) for by_samples in cells.values() for cell in by_samples.values() for seed in SEEDS]:
                done.result()
        scenes = {name: {samples: cells[name][samples].result() for samples in ("16", "64")} for name in sorted(cells)}
    results[device] = {"device": kind, "size": size, "at_once": at_once, "scenes": scenes}
    write_results(out, results, device)


if __name__ == "__main__":
    if len(sys.argv) != 5 or sys.argv[3] not in DEVICES:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
