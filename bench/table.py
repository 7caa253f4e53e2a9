#!/usr/bin/env python3
"""Prints the results of bench_cuda, a JSON file, as the table of docs/performance.md.

usage: bench/table.py bench/results/cuda-stages.json
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


def main(path):
    print("| stage | floor | floor, ms | measured, ms | ratio |")
    print("| --- | --- | --- | --- | --- |")
    for b in json.load(open(path))["benchmarks"]:
        stage, *arguments = b["name"].split("/iterations")[0].split("/")
        name = f"`{stage}` {' '.join(a.replace(':', ' ') for a in arguments)}".strip()
        print(f"| {name} | {FLOORS[stage]} | {b['floor_ms']:.3g} | {b['median_ms']:.3g} | {b['ratio']:.2f} |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    main(sys.argv[1])
