#!/usr/bin/env python3
"""Measures the effect of single options with wfpg-quality, for bench/tuning_plot.py. Each option has several values,
and all others their defaults.

usage: bench/tuning.py DIRECTORY_OF_PROGRAMS OUT.json FOLDER [DEVICE]

wfpg-quality writes pictures, references and its other files to FOLDER. An interrupted run resumes. DEVICE is cpu or
cuda. Their errors differ only by noise.
"""
import json
import os
import subprocess
import sys

from programs import begin_results

SCENES = ("ajar", "cornell-enclosed --nee off")
SETTINGS = "--size 96x96 --spp 64 --seeds 2 --reference-spp 2048".split()
DEFAULT = "wfpg"

# Title of the plot, wfpg-render's arguments for a value, the values, the default, and arguments of all runs.
OPTIONS = (
    ("kept.budget_bytes, MiB", "--field-budget {}MiB", (1, 4, 16, 24, 32, 64), 24, ""),
    ("kept.resolution", "--slot-resolution {}", (12, 16, 24, 32, 48), 32, ""),
    ("octree_resolution", "--octree-resolution {}", (32, 64, 128, 256), 128, ""),
    ("rays_per_bin", "--rays-per-bin {}", (16, 64, 256, 1024), 64, ""),
    ("kept.recast", "--recast {}", (1, 4, 8, 16, 32, 64), 32, ""),
    ("guide_fraction", "--guide-fraction {}", (0.3, 0.5, 0.7, 0.9, "learnt"), "learnt", ""),
    ("product_resolution", "--method wfpg-product --product-resolution {}", (0, 4, 8), 0, ""),
    # Such small pictures have at most 16 deposits a leaf if the octree is fine.
    ("deposits_per_leaf, octree 32", "--deposits-per-leaf {}", (1, 4, 16), 16, "--octree-resolution 32"),
    ("kept.recast, learn off", "--recast {}", (8, 32), 32, "--learn off"),
    ("kept.learn", "--learn {}", ("off", "on"), "on", ""),
)


def arguments_of(template, value, default, others):
    return " ".join(part for part in (others, "" if value == default else template.format(value)) if part)


def name_of(arguments):
    """A method's name, the same for the same arguments."""
    return arguments.replace("--method ", "").replace("--", "").replace(" ", "-") or DEFAULT


def methods():
    """Arguments of wfpg-quality: each rendering once, whatever options it stands for."""
    all_arguments = (arguments_of(t, v, d, o) for _, t, values, d, o in OPTIONS for v in values)
    named = {name_of(a): a for a in all_arguments if a}
    return ["--methods", f"pt,{DEFAULT}", *(x for n, a in named.items() for x in ("--method", f"{n}={a}"))]


def summaries(results):
    """By scene and method: errors, which are MSE after c / (1 + c), and what they cost in cones and memory."""
    found = {}
    for scene in results["scenes"]:
        lines = found[scene["scene"]] = {}
        for method in scene["summary"][0]["methods"]:
            error = method["errors"]["mse_reinhard"]
            lines[method["method"]] = {
                "error": error["mean"],
                "standard_error": error["standard_error"],
                "gain": error["ratio"],
                "cones_per_segment": method["cones_per_segment"],
                "persistent_bytes": method["persistent_bytes"],
            }
    return found


def main(programs, out, folder, device="cpu"):
    begin_results(out)  # before minutes of work
    settings = [*SETTINGS, "--device", device]
    command = ["--scenes", *SCENES, *settings, *methods()]
    subprocess.run([os.path.join(programs, "wfpg-quality"), *command, "--cache", os.path.join(folder, "cache"),
                    "--output", folder], check=True)
    with open(os.path.join(folder, "results.json")) as file:
        results = json.load(file)
    found = summaries(results)
    options = {}
    for option, template, values, default, others in OPTIONS:
        options[option] = points = []
        for value in values:
            arguments = arguments_of(template, value, default, others)
            points.append({"value": value, "arguments": arguments, "is_default": value == default,
                           "scenes": {scene: lines[name_of(arguments)] for scene, lines in found.items()}})
    written = {
        "settings": " ".join(settings),
        **{key: results[key] for key in ("version", "program", "machine")},
        "references": {s["scene"]: s["reference"]["noise"]["mse_reinhard"] for s in results["scenes"]},
        "path_tracing": {scene: lines["pt"]["error"] for scene, lines in found.items()},
        "options": options,
    }
    with open(out, "w") as file:
        json.dump(written, file, indent=1)
        file.write("\n")


if __name__ == "__main__":
    if not 4 <= len(sys.argv) <= 5:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
