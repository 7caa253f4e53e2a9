#!/usr/bin/env python3
"""Times samples of upbp in two scenes of the UPBP paper on the GPU, stage by stage, and writes results for tools/publish.

usage: bench/upbp_times.py DIRECTORY_OF_PROGRAMS OUT.json SCENES [RUNS]

The folder SCENES has mirrorballs.gltf, stilllife.gltf and its map stilllife.exr. tools/upbp_scenes makes them. Sizes, segments,
radii and numbers of beams are those of the paper. A run is as in light_times.py. Times are medians over RUNS (3) runs, after one
that warms up.
"""
import os
import sys
import tempfile

from light_times import median_sample
from programs import Programs, write_results

RADII = ("--radius", "0.0015", "--volume-radius", "0.001")
SCENES = {
    "Mirror Balls": ("mirrorballs.gltf", "800x800", ("--max-depth", "12", "--beam-paths", "4000")),
    "Still Life": ("stilllife.gltf", "1600x700", ("--max-depth", "80", "--beam-paths", "23000", "--environment", "stilllife.exr")),
}


def measure(directory, scenes, name, runs):
    scene, size, options = SCENES[name]
    found = [os.path.join(scenes, o) if o.endswith(".exr") else o for o in options]
    with tempfile.TemporaryDirectory() as folder:
        times = median_sample(Programs(directory, size, folder), os.path.join(scenes, scene),
                              ["--method", "upbp", *RADII, *found], runs)
    return {"scene": name, "size": size, "options": " ".join((*RADII, *options)), "milliseconds": times}


def main(directory, out, scenes, runs="3"):
    samples = []
    for name in SCENES:
        print(name, file=sys.stderr)
        samples.append(measure(directory, scenes, name, int(runs)))
    write_results(out, {"runs": int(runs), "samples": samples})


if __name__ == "__main__":
    if not 4 <= len(sys.argv) <= 5:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
