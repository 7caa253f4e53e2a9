#!/usr/bin/env python3
"""Prints results as a table. tools/publish makes those of the pages, with its help.

usage: bench/table.py bench/results/NAME.json [...]

Several files must be results of wfpg-quality with the same methods in other scenes.
"""
import json
import re
import sys

# The floor of each stage; its source explains it. On CPUs a label names another floor.
FLOORS = {
    "voxelization": "writing the fragments and sorting them",
    "octree_and_cache": "CUB's sort of the codes",
    "binning": "CUB's sort of as many 21-bit keys",
    "making_fields": "reading the hits",
    "serving_rays": "reading surfaces, writing directions",
    "refreshing_slots": "reading hits, writing distributions",
    "serving_kept": "reading surfaces, writing directions",
    "depositing": "reading the vertices",
    "casting": "OptiX, the same rays",
    "building_boxes": "CUB's sort of as many 63-bit keys",
    "finding_photons": "reading points and photons that are found",
    "merging": "as many rays among as many triangles",
    "connecting": "connections without weights",
    "iteration": "its own rays, cast again alone",
}
MEASURES = ("mse_reinhard", "relmse_robust")
STAGES = ("trace", "sort", "lights", "directions", "shade", "update")


def print_table(rows):
    """Prints rows of text, the head first."""
    for row in [rows[0], ["---"] * len(rows[0]), *rows[1:]]:
        print(f"| {' | '.join(row)} |")


def with_casting(benchmarks, casting):
    """Stages, with those of `casting` in place of what a build without OptiX measured beside copies."""
    return [b for b in benchmarks if not b["name"].startswith("casting/")] + casting


def stage_rows(benchmarks):
    rows = [["stage", "floor", "floor, ms", "measured, ms", "ratio"]]
    for b in benchmarks:
        stage, *arguments = b["name"].split("/iterations")[0].split("/")
        name = f"`{stage}` {', '.join(a.replace(':', ' ') for a in arguments)}".strip()
        floor = b.get("label", FLOORS[stage])  # if the floor is another
        rows.append([name, floor, f"{b['floor_ms']:.3g}", f"{b['median_ms']:.3g}", f"{b['ratio']:#.3g}"])
    return rows


def three(value, least_decimals=0):
    """A number with three digits that matter: 0.94, 9.43, 10.7, 125. Empty for None."""
    if value is None:
        return ""
    for decimals, limit in ((2, 9.995), (1, 99.95)):
        if abs(value) < limit:
            return f"{value:.{max(decimals, least_decimals)}f}"
    return f"{value:.{least_decimals}f}"


def ratio(value):
    return "" if value is None else f"{value:.2f}"


def error(value):
    return f"{value:.2e}" if value > 0.0 else "below the references' noise"


def print_equal_time(scenes):
    print("| scene | method | samples | MSE after c / (1 + c) | pt's over it | relative MSE, trimmed | pt's over it |", end="")
    print(" million segments | ms a sample |", " | ".join(STAGES), "| MiB kept | MiB in flight |")
    print("| --- " * (11 + len(STAGES)) + "|")
    for scene in scenes:
        for name, m in scene["methods"].items():
            ms = m["milliseconds_a_sample"]
            stages = " | ".join(f"{ms.get(stage, 0.0):.2f}" for stage in STAGES)
            print(
                f"| {scene['scene']} | {name} | {m['spp']} | {m['mse_reinhard']:.2e} | {ratio(m['ratios']['mse_reinhard'])} "
                f"| {error(m['relmse_trimmed'])} | {ratio(m['ratios']['relmse_trimmed'])} | {m['segments_a_sample'] * 1e-6:.2f} "
                f"| {ms['total']:.2f} | {stages} | {m['persistent_bytes'] / 2**20:.1f} | {m['transient_bytes'] / 2**20:.0f} |"
            )


def print_sample_times(scenes):
    print("| scene | method | million segments | ms |", " | ".join(STAGES), "| ratio to pt | and per segment |")
    print("| --- " * (6 + len(STAGES)) + "|")
    for scene in scenes:
        ratios = {"pt": (1.0, 1.0), "wfpg": (scene["ratio_a_sample"], scene["ratio_a_segment"])}
        for name, ms in scene["milliseconds"].items():
            stages = " | ".join(f"{ms[stage]:.2f}" for stage in STAGES)
            print(
                f"| {scene['scene']} | {name} | {ms['segments'] * 1e-6:.2f} | {ms['total']:.2f} | {stages} "
                f"| {ratios[name][0]:.3f} | {ratios[name][1]:.3f} |"
            )


def errors_at(scene, budget):
    """By method: the mean over seeds of its errors at a budget, less the reference's noise, and of seconds."""
    sums = {}
    for run in scene.get("runs", []):
        for point in run.get("points", []):
            if f"{point['samples']} samples" == budget:
                sums.setdefault(run["method"], []).append(point)
    if not sums:  # some results have only what follows
        return {
            m["method"]: {**{e: m["errors"][e]["mean"] for e in MEASURES}, "seconds": m["seconds"]["mean"]}
            for summary in scene["summary"] if summary["budget"] == budget for m in summary["methods"]
        }
    return {
        method: {
            **{e: sum(p["error"][e] for p in points) / len(points) - scene["reference"]["noise"][e] for e in MEASURES},
            "seconds": sum(p["seconds"] for p in points) / len(points),
        }
        for method, points in sums.items()
    }


def methods_and_budget(scene):
    """Its methods, and how far they went."""
    last = scene["summary"][-1]
    return tuple(m["method"] for m in last["methods"]), last["budget"]


def print_gains(scenes):
    """Tables of scenes with the same methods and budget: at that, and after 64, 256, 1024 and 4096 samples on the way."""
    names = [scene["scene"].split("/")[-1].split(" ")[0].removesuffix(".glb") for scene in scenes]
    methods, last = methods_and_budget(scenes[0])
    for budget in dict.fromkeys([f"{n} samples" for n in (64, 256, 1024, 4096)] + [last]):
        at = [errors_at(scene, budget) for scene in scenes]
        if not all(set(methods) <= set(errors) for errors in at):
            continue
        print(f"| {budget}: gain (relative MSE; equal time) |", " | ".join(names), "|")
        print("| --- " * (1 + len(names)) + "|")
        for method in methods:
            cells = []
            for errors in at:
                mse, relative = (errors["pt"][e] / errors[method][e] for e in MEASURES)
                equal = mse * errors["pt"]["seconds"] / errors[method]["seconds"]
                cells.append(f"{mse:.2f} ({relative:.2f}; {equal:.2f})")
            print(f"| {method} |", " | ".join(cells), "|")
        print()
    print("| MiB kept (in use) |", " | ".join(names), "|")
    print("| --- " * (1 + len(names)) + "|")
    for i, method in enumerate(methods):
        cells = []
        for scene in scenes:
            cost = scene["summary"][-1]["methods"][i]
            used = f" ({cost['used_bytes'] / 2**20:.1f})" if "used_bytes" in cost else ""
            cells.append(f"{cost['persistent_bytes'] / 2**20:.1f}{used}")
        print(f"| {method} |", " | ".join(cells), "|")


def compiler_rows(compilers):
    rows = [["compiler", "source", "seconds", "ratio to Thrust and GLM", "MiB at most", "program, KiB"]]
    for compiler, sources in compilers.items():
        name = re.sub(r" \(.*?\)|^Debian | version", "", compiler)
        for source, m in sources.items():
            rows.append([name, source, f"{m['seconds']:.2f}", f"{m['ratio']:.2f}", f"{m['mebibytes']:.0f}",
                         f"{m['program_bytes'] / 1024:.0f}"])
    return rows


def main(paths):
    results = [json.load(open(path)) for path in paths]
    first = results[0]
    if "benchmarks" in first:
        print_table(stage_rows(first["benchmarks"]))
    elif "baseline" in first:
        groups = {}
        for result in results:
            for scene in result["scenes"]:
                groups.setdefault(methods_and_budget(scene), []).append(scene)
        for scenes in groups.values():
            print_gains(scenes)
            print()
    elif "compilers" in first:
        print_table(compiler_rows(first["compilers"]))
    elif "settled_samples" in first:
        print_sample_times(first["settled_samples"])
    elif "reference_seconds" in first:
        print_equal_time(first["scenes"])
    else:
        sys.exit(f"bench/table.py: {paths[0]} has no table that is made here")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__.strip())
    main(sys.argv[1:])
