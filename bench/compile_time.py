#!/usr/bin/env python3
"""Measures compile times with wfpg, and writes results for bench/table.py.

usage: bench/compile_time.py OUT.json [RUNS [COMPILER ...]]

Each COMPILER (g++ and clang++) compiles and links the sources one after the other as a release build does, RUNS (10)
times in turn. Times are processor times, medians over the runs. Sizes are of stripped programs. The baseline is a source
that includes only the same headers of Thrust and GLM.
"""
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FLAGS = ["-std=c++17", "-O3", "-DNDEBUG", "-I" + os.path.join(ROOT, "include"),
         "-DTHRUST_DEVICE_SYSTEM=THRUST_DEVICE_SYSTEM_CPP"]
EMPTY = "int main() {}\n"
MINIMAL = os.path.join(ROOT, "examples", "minimal.cpp")


def foreign_includes():
    """Of Thrust and GLM, in the headers that minimal.cpp reaches."""
    make = subprocess.run(["g++", *FLAGS, "-MM", MINIMAL], check=True, stdout=subprocess.PIPE, text=True).stdout
    found = set()
    for header in re.findall(r"\S+/wfpg/\S+\.hpp", make):
        with open(header) as file:
            found.update(re.findall(r"^#include <(?:glm|thrust)/.*$", file.read(), re.MULTILINE))
    return "\n".join(sorted(found)) + "\n"


def sources():
    with open(MINIMAL) as file:
        minimal = file.read()
    return {
        "empty": EMPTY,
        "Thrust and GLM": foreign_includes() + EMPTY,
        "wfpg/path_guider.hpp": "#include <wfpg/exec/seq.hpp>\n#include <wfpg/path_guider.hpp>\n" + EMPTY,
        "examples/minimal.cpp": minimal,
    }


def compile_once(compiler, source, program):
    """Seconds of processor time, MiB at most and the program's bytes."""
    process = subprocess.Popen([compiler, *FLAGS, "-s", source, "-o", program])
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{compiler} did not compile {source}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, os.path.getsize(program)


def measure(compiler, runs, folder):
    files = {}
    for i, (name, text) in enumerate(sources().items()):
        files[name] = os.path.join(folder, f"{i}.cpp")
        with open(files[name], "w") as file:
            file.write(text)
    lines = {name: [] for name in files}
    for _ in range(runs):
        for name, source in files.items():
            lines[name].append(compile_once(compiler, source, os.path.join(folder, "program")))
    beside = lines["Thrust and GLM"]
    return {
        name: {
            "seconds": statistics.median(line[0] for line in of_name),
            "ratio": statistics.median(line[0] / b[0] for line, b in zip(of_name, beside)),
            "mebibytes": statistics.median(line[1] for line in of_name),
            "program_bytes": of_name[0][2],
        }
        for name, of_name in lines.items()
    }


def version(compiler):
    return subprocess.run([compiler, "--version"], check=True, stdout=subprocess.PIPE, text=True).stdout.split("\n")[0]


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    compilers = sys.argv[3:] or ["g++", "clang++"]
    with tempfile.TemporaryDirectory() as folder:
        results = {version(compiler): measure(compiler, runs, folder) for compiler in compilers}
    with open(sys.argv[1], "w") as file:
        machine = f"{os.cpu_count()} cores, {platform.machine()}"
        json.dump({"command": " ".join(sys.argv), "machine": machine, "runs": runs, "compilers": results}, file, indent=1)
        file.write("\n")


if __name__ == "__main__":
    main()
