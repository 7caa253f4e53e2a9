#!/usr/bin/env python3
"""Prints results as a table of docs/performance.md or docs/quality.md.

usage: bench/table.py bench/results/NAME.json
"""
import json
import sys

# What a benchmark's floor is: see the sources in bench/cuda/.
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
}
STAGES = ("trace", "sort", "lights", "directions", "shade", "update")


def print_stages(benchmarks):
    print("| stage | floor | floor, ms | measured, ms | ratio |")
    print("| --- | --- | --- | --- | --- |")
    for b in benchmarks:
        stage, *arguments = b["name"].split("/iterations")[0].split("/")
        name = f"`{stage}` {', '.join(a.replace(':', ' ') for a in arguments)}".strip()
        print(f"| {name} | {FLOORS[stage]} | {b['floor_ms']:.3g} | {b['median_ms']:.3g} | {b['ratio']:.2f} |")


def ratio(value):
    return "" if value is None else f"{value:.2f}"


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
                f"| {m['relmse_trimmed']:.2e} | {ratio(m['ratios']['relmse_trimmed'])} | {m['segments_a_sample'] * 1e-6:.2f} "
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


def print_gains(scenes):
    print("| scene | samples | method | gain in MSE after c / (1 + c) | at equal time | gain in relative MSE | seconds | MiB kept |")
    print("| --- " * 8 + "|")
    for scene in scenes:
        name = scene["scene"].split("/")[-1]
        for budget in scene["summary"]:
            for m in budget["methods"]:
                mse, relative = (m["errors"][e] for e in ("mse_reinhard", "relmse_robust"))
                print(
                    f"| {name} | {m['samples']['mean']:.0f} | {m['method']} | {ratio(mse['ratio'])} "
                    f"| {ratio(mse.get('equal_time_ratio'))} | {ratio(relative['ratio'])} | {m['seconds']['mean']:.2f} "
                    f"| {m['persistent_bytes'] / 2**20:.1f} |"
                )


def main(path):
    results = json.load(open(path))
    if "benchmarks" in results:
        print_stages(results["benchmarks"])
    elif "baseline" in results:
        print_gains(results["scenes"])
    elif "settled_samples" in results:
        print_sample_times(results["settled_samples"])
    else:
        print_equal_time(results["scenes"])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    main(sys.argv[1])
