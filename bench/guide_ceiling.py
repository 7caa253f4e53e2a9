#!/usr/bin/env python3
"""Measures how much of the possible gain a guide has: the table of docs/ablations.md.

usage: bench/guide_ceiling.py DIRECTORY_OF_PROGRAMS OUT.json FOLDER_OF_GLTF [SCENE ...]

Guides of several sizes are trained for long and saved. Renderings then begin with them, and others with nothing. Each scene has four
seeds. A variance is half of the mean difference of two seeds' pictures. Renderings have one thread; two cores fewer than there are
have a rendering each. OUT.json keeps the scenes that are not named.
"""
import concurrent.futures
import os
import sys
import tempfile

from programs import SEEDS, Programs, begin_results, renderings_at_once, unguided_options, write_results

BUILT_IN = {"ajar": "", "glossy-room": "--nee off", "thin-wall": "--max-depth 6"}
FILES = {"bathroom.glb": "", "cornell-box.glb": "", "staircase2.glb": "", "veach-ajar.glb": "", "veach-mis.glb": "--light-groups 1"}
FINER, LARGER = ["--slot-resolution", "48"], ["--field-budget", "1GiB"]
GUIDES = {"default": [], "finer": FINER, "larger": LARGER, "both": [*FINER, *LARGER]}
TRAINING, SAMPLES, SIZE = 192, 32, "256x256"


class Scene:
    """Renderings of a scene, in a folder of their own."""

    def __init__(self, directory, folder, scene, options):
        self.scene, self.options, self.folder = scene, options.split(), folder
        os.makedirs(folder)
        self.programs = Programs(directory, SIZE, folder, "seq")

    def guide(self, name):
        return os.path.join(self.folder, name + ".guide")

    def guided(self, spp, seed, picture, more):
        """A guide that never rests, so that all of what it knows is measured."""
        return self.programs.render(self.scene, picture, ["--spp", str(spp), "--seed", str(seed), "--method", "wfpg", "--least-gain", "0",
                                                          *self.options, *more])

    def train(self, name):
        """Saves a guide. Returns the bytes of its fields in use."""
        stats = self.guided(TRAINING, max(SEEDS) + 1, name, [*GUIDES[name], "--save-guide", self.guide(name)])
        print(os.path.basename(self.scene), name, file=sys.stderr, flush=True)
        return stats["slots"]["live_bytes"]

    def unguided(self, seed):
        self.programs.render(self.scene, f"pt{seed}", ["--spp", str(SAMPLES), "--seed", str(seed), "--method", "pt",
                                                       *unguided_options(self.options)])

    def cold(self, seed):
        self.guided(SAMPLES, seed, f"cold{seed}", [])

    def trained(self, name, seed):
        self.guided(SAMPLES, seed, f"{name}{seed}", [*GUIDES[name], "--load-guide", self.guide(name)])


def measure(scenes):
    """Gains over path tracing, and bytes of the guides' fields."""
    with concurrent.futures.ThreadPoolExecutor(renderings_at_once()) as threads:
        sizes = {scene: {g: threads.submit(scene.train, g) for g in reversed(GUIDES)} for scene in scenes}  # the longest first
        others = [threads.submit(render, seed) for scene in scenes for seed in SEEDS for render in (scene.cold, scene.unguided)]
        for done in others:
            done.result()
        bytes_of = {scene: {g: size.result() for g, size in of_guides.items()} for scene, of_guides in sizes.items()}
        for done in [threads.submit(scene.trained, g, seed) for scene in scenes for g in GUIDES for seed in SEEDS]:
            done.result()
    result = {}
    for scene in scenes:
        unguided = scene.programs.variance("pt")
        result[os.path.basename(scene.scene)] = {
            "gain": {name: round(unguided / scene.programs.variance(name), 3) for name in ("cold", *GUIDES)},
            "bytes": {name: bytes_of[scene][name] for name in GUIDES}}
    return result


def main(directory, out, folder, *chosen):
    options = {**FILES, **BUILT_IN}
    if unknown := [name for name in chosen if name not in options]:
        sys.exit(f"{unknown[0]} is none of {', '.join(sorted(options))}")
    places = {name: os.path.join(folder, name) if name in FILES else name for name in chosen or options}
    if missing := [place for name, place in places.items() if name in FILES and not os.path.exists(place)]:
        sys.exit(f"cannot read {missing[0]}")
    results = begin_results(out)
    with tempfile.TemporaryDirectory() as pictures:
        found = measure([Scene(directory, os.path.join(pictures, name), place, options[name]) for name, place in places.items()])
    scenes = {**results.get("scenes", {}), **found}
    write_results(out, {"size": SIZE, "training": TRAINING, "samples": SAMPLES, "scenes": {name: scenes[name] for name in sorted(scenes)}})


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
