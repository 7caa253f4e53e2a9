#!/usr/bin/env python3
"""Measures how renderings scale over the GPUs of one machine, and that guides and pictures do not depend on their number.

usage: bench/ranks/gpus.py PROGRAM RESULTS.json RUNS SCENE=SAMPLES...

PROGRAM is wfpg-render with CUDA and NCCL. A scene is rendered by 1, 2, 4, ... GPUs, as many as there are, with SAMPLES a
pixel and eight of them a wave; the first scene with one a wave, too. Several GPUs take RUNS runs. Before them guides and
pictures of 192 samples are compared: other bytes are an error. After them follow times of 192 samples. Results replace
"gpus" in RESULTS.json.

Seconds are all but start-up, reading the scene, joining GPUs, and writing files. NVLink multicast is off.
"""
import hashlib
import json
import os
import subprocess
import sys
import tempfile

from measure import formatted

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from programs import gpu_and_driver  # noqa: E402, bench/programs.py

SIZE, WAVE, SHORT = "1920x1080", 8, 192
SAMPLES = ["--split", "samples", "--samples-a-wave", str(WAVE)]
TILES = ["--split", "tiles"]


def numbers_of_gpus():
    """1, 2, 4, ... up to what there is."""
    found = len(gpu_and_driver().splitlines())
    return [n for n in (1, 2, 4, 8, 16) if n <= found]


def name_of(scene):
    return os.path.splitext(os.path.basename(scene))[0]


class Renderer:
    """Renders by several GPUs into a folder."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def render(self, scene, spp, gpus, split, save_guide=False):
        """Returns seconds by stage, and hashes of the picture and the guide."""
        picture, guide, stats = (os.path.join(self.folder, name) for name in ("x.exr", "x.guide", "x.json"))
        command = [self.program, scene, "--size", SIZE, "--spp", str(spp), "--seed", "1", "--method", "wfpg", "--device",
                   "cuda:" + ",".join(map(str, range(gpus))), *split, "-o", picture, "--stats", stats]
        subprocess.run(command + (["--save-guide", guide] if save_guide else []), check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "NCCL_NVLS_ENABLE": "0"})
        with open(stats) as file:
            seconds = json.load(file)["seconds"]
        hashes = []
        for path in (picture, guide)[:1 + save_guide]:
            with open(path, "rb") as file:
                hashes.append(hashlib.sha256(file.read()).hexdigest())
        print(f"{name_of(scene)}, {gpus} GPUs, {' '.join(split)}, {spp} samples: {seconds['total']:.2f} s", flush=True)
        return seconds, hashes


def times(renderer, scene, spp, split, numbers, runs):
    """Seconds in all by number of GPUs, and by stage in the last run."""
    totals, stages = {}, {}
    for n in numbers:
        found = [renderer.render(scene, spp, n, split)[0] for _ in range(runs if n > 1 else 1)]
        totals[str(n)] = [round(seconds["total"], 4) for seconds in found]
        stages[str(n)] = {name: round(s, 4) for name, s in found[-1].items() if not name.startswith("guide ")}
    return totals, stages


def require_equal(renderer, scene, numbers):
    """Returns the hashes of picture and guide, which all numbers of GPUs have."""
    found = {n: renderer.render(scene, SHORT, n, SAMPLES, save_guide=True)[1] for n in numbers}
    if any(hashes != found[1] for hashes in found.values()):
        sys.exit(f"{scene}: pictures or guides differ by the number of GPUs: {found}")
    return dict(zip(("picture", "guide"), found[1]))


def main(program, results, runs, *scenes):
    numbers = numbers_of_gpus()
    if not numbers:
        sys.exit("gpus.py: nvidia-smi finds no GPU here")
    if not os.access(program, os.X_OK):
        sys.exit(f"gpus.py: {program} is no program; build it by the preset cuda")
    wanted = []
    for argument in scenes:
        scene, _, spp = argument.rpartition("=")
        if not scene or not spp.isdecimal() or int(spp) < 2:
            sys.exit(f"gpus.py: {argument} is not SCENE=SAMPLES")
        if scene.endswith((".glb", ".gltf")) and not os.path.exists(scene):
            sys.exit(f"gpus.py: there is no {scene}")
        wanted.append((scene, int(spp)))
    if not os.path.exists(results):
        sys.exit(f"gpus.py: there is no {results}, of which it replaces a part")
    found = {"size": SIZE, "samples_a_wave": WAVE, "numbers": numbers, "scenes": {}, "short": {}, "stages": {}, "equal": {}}
    with tempfile.TemporaryDirectory() as folder:
        renderer = Renderer(program, folder)
        for scene, spp in wanted:
            name = name_of(scene)
            found["equal"][name] = require_equal(renderer, scene, numbers)
            samples, found["stages"][name] = times(renderer, scene, spp, SAMPLES, numbers, int(runs))
            found["scenes"][name] = {"spp": spp, "samples": samples}
            found["short"][name] = {"spp": SHORT, "samples": times(renderer, scene, SHORT, SAMPLES, numbers, 1)[0]}
        scene, spp = wanted[0]
        tiles = found["scenes"][name_of(scene)]
        tiles["tiles_spp"] = spp // 2
        tiles["tiles"] = times(renderer, scene, spp // 2, TILES, numbers, 1)[0]
        tiles["alone"] = [round(renderer.render(scene, spp // 2, 1, [])[0]["total"], 4)]
    with open(results) as file:
        everything = json.load(file)
    everything["gpus"] = found
    with open(results, "w") as file:
        file.write(formatted(everything) + "\n")


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
