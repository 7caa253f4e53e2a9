#!/usr/bin/env python3
"""Counts the instructions that five stages execute on the serial policy, and compares such counts.

usage: bench/instructions.py PROGRAM OUT.json [COMMIT]
       bench/instructions.py BEFORE.json AFTER.json

PROGRAM is bench_cpu, which runs each stage once under valgrind's callgrind. Only calls of bench::run_stage count. The
same program and libraries give the same counts, whatever else the machine does. COMMIT is what PROGRAM was built from
(default: what is checked out here). Takes half a minute and needs valgrind.
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
STAGES = {  # one benchmark each
    "octree and cache": "octree_and_cache/seq/thousands:200/resolution:128",
    "binning": "binning/seq/resolution:64/bounces:2",
    "transient fields of a wave": "serving_rays/seq/P:0/material:1",
    "kept fields of a wave": "serving_kept/seq/P:0/material:0",
    "deposits and update": "depositing/seq/resolution:64/percent_in_one:0",
}


def output_of(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def count(program, benchmark):
    """Instructions of one iteration."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "callgrind.out")
        command = ["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=bench::run_stage(*)",
                   f"--callgrind-out-file={out}", program, "--once", f"--benchmark_filter=^{benchmark}/"]
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if run.returncode != 0:
            sys.exit(f"{' '.join(command)}\n{run.stdout}")
        with open(out) as file:
            counted = int(re.search(r"^(?:totals|summary): (\d+)", file.read(), re.MULTILINE).group(1))
    if counted == 0:
        sys.exit(f"{program} has no benchmark {benchmark}")
    return counted


def measure(program, out, commit):
    counts = {}
    for stage, benchmark in STAGES.items():
        counts[stage] = count(program, benchmark)
        print(f"{stage}: {counts[stage]}", flush=True)
    with open(out, "w") as file:
        json.dump({"command": " ".join(sys.argv), "commit": commit, "valgrind": output_of("valgrind", "--version"),
                   "benchmarks_counted": STAGES, "instructions": counts}, file, indent=1)
        file.write("\n")


def compare(before, after):
    results = []
    for path in (before, after):
        with open(path) as file:
            results.append(json.load(file))
    print(f"| stage | {results[0]['commit']} | {results[1]['commit']} | ratio |")
    print("| --- | --- | --- | --- |")
    for stage, old in results[0]["instructions"].items():
        new = results[1]["instructions"][stage]
        print(f"| {stage} | {old * 1e-6:.2f} M | {new * 1e-6:.2f} M | {new / old:.4f} |")


def main(arguments):
    if len(arguments) == 2 and all(a.endswith(".json") for a in arguments):
        compare(*arguments)
    elif len(arguments) in (2, 3) and not arguments[0].endswith(".json"):
        if not os.access(arguments[0], os.X_OK):
            sys.exit(f"instructions.py: {arguments[0]} is no program; the preset bench builds bench_cpu")
        if not shutil.which("valgrind"):
            sys.exit("instructions.py: valgrind is needed, and was not found")
        commit = arguments[2] if len(arguments) == 3 else output_of("git", "-C", ROOT, "describe", "--always", "--dirty")
        measure(os.path.abspath(arguments[0]), arguments[1], commit)
    else:
        sys.exit(__doc__.strip())


if __name__ == "__main__":
    main(sys.argv[1:])
