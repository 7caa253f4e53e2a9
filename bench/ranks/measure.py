#!/usr/bin/env python3
"""Measures what processes that render one picture send, and what it costs them.

usage: bench/ranks/measure.py PROGRAM SCENE SIZE PROCESSES SAMPLES RESULTS.json

PROGRAM is wfpg-render with MPI, built with -DCMAKE_CXX_FLAGS="-g1 -fno-omit-frame-pointer", so that perf finds kernels.
Processes have one thread each, on the cores in turn, and share tiles. Seconds are CPU seconds of a process, so that
others on the machine, and more processes than cores, hardly change them. Those of waiting for other processes are left
out: mpi_calls.cpp lets processes meet before each reduction, and of its seconds those of the fastest count.

Needs mpirun, mpicxx and perf. Results of other scenes, sizes and numbers of processes in RESULTS.json stay.

Bytes are those of arrays, each counted once, whatever MPI does with them.
"""
import bisect
import collections
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
WARM_UP = 32  # samples
PACKING = re.compile(r"call_packed_step|count_queued|exchange_(origin|use|fractions)|invert_wanted|number_builds|write_origins|"
                     r"(take|put)_counts|write_path_words|keep_path_words|field_ranks<|bin_ranks<|rank_counters<|rank_exchange<|packed_sums<")
COPIES = re.compile(r"mem(cpy|move|set)")  # of libc, which keeps no frame: its caller's caller is the next one
CARRIERS = re.compile(r"sum_of_ranks|mpi_communicator<|share_|end_sample|value_queue<")
MPI = re.compile(r"libmpi|libopen-|mca_|mpi_calls")
CALL = re.compile(r"(sum|max)(\d+) (\d+) (\S+) (\S+) (\S+) (\S+)")
Call = collections.namedtuple("Call", "kind bits bytes reducing waiting process clock")


def run(program, scene, size, processes, samples, folder):
    library, script = os.path.join(folder, "mpi_calls.so"), os.path.join(folder, "process.sh")
    subprocess.run(["mpicxx", "-std=c++17", "-O2", "-shared", "-fPIC", "-w", os.path.join(HERE, "mpi_calls.cpp"), "-o",
                    library], check=True)
    with open(script, "w") as file:
        file.write(f"""rank=$OMPI_COMM_WORLD_RANK
export CALLS_OUT={folder}/calls LD_PRELOAD={library}
exec perf record -q -k mono -e cpu-clock -F 997 --call-graph fp -o {folder}/perf.$rank taskset -c $((rank % $(nproc))) "$@"
""")
    command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(processes), "bash", script, program, scene,
               "--method", "wfpg", "--split", "tiles", "--size", size, "--spp", str(samples), "--seed", "1",
               "--rank-seconds", "300", "-o", os.path.join(folder, "out.exr")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def samples_of(path):
    """Reductions of a rank, sample by sample. Before each sample, and after the last, ranks ask whether one of them ends:
    two words."""
    samples = [[]]
    with open(path) as file:
        for match in CALL.finditer(file.read()):
            call = Call(match[1], int(match[2]), int(match[3]), *(float(match[i]) for i in range(4, 8)))
            samples[-1].append(call)
            if (call.kind, call.bits, call.bytes) == ("max", 32, 8):
                samples.append([])
    return samples[1:-1]  # before the first sample ranks join, and after the last one they join pictures


def is_packing(frames):
    """Whether a stack, the innermost function first, is that of what ranks pack or copy."""
    symbol, where = frames[0]
    if MPI.search(where) or any("sched_yield" in f[0] or "MPI_" in f[0] for f in frames):
        return False
    if any(PACKING.search(f[0]) for f in frames[:3]):
        return True
    return bool(COPIES.search(symbol)) and any(CARRIERS.search(f[0]) for f in frames[1:3])


def packing_seconds(path, ends):
    """CPU seconds of packing in each sample. `ends`: monotonic clock at their ends."""
    script = subprocess.run(["perf", "script", "-i", path, "-F", "time,ip,sym,dso"], check=True, stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL, text=True).stdout
    seconds = [0.0] * (len(ends) + 1)
    for block in script.split("\n\n"):
        lines = block.strip().split("\n")
        if len(lines) < 2:
            continue
        frames = [(line.strip().split(" ", 1)[-1], line.rsplit("(", 1)[-1]) for line in lines[1:]]
        if is_packing(frames):
            seconds[bisect.bisect_left(ends, float(lines[0].strip().rstrip(":")))] += 1.0 / 997
    return seconds[:len(ends)]


def summary(ranks, packing, first, last):
    """Means over ranks and over the samples [first, last)."""
    parts = collections.Counter()
    n = len(ranks) * (last - first)
    for samples, packs in zip(ranks, packing):
        for i in range(first, last):
            before = samples[i - 1][-1].process
            parts["all"] += (samples[i][-1].process - before - sum(c.waiting for c in samples[i])) / n
            parts["packing"] += packs[i] / n
    for i in range(first, last):
        for calls in zip(*(samples[i] for samples in ranks)):
            # The others wait within the reduction for one that is late.
            parts["reducing"] += min(c.reducing for c in calls) / (last - first)
            parts["calls"] += 1 / (last - first)
            parts["mib"] += calls[0].bytes / 2**20 / (last - first)
    return {name: round(value, 6) for name, value in parts.items()}


def call_seconds(ranks):
    """Seconds of a reduction and of each MiB of it: least squares over all of them after warm-up, so that sums agree."""
    calls = [(group[0].bytes / 2**20, min(c.reducing for c in group))
             for samples in list(zip(*ranks))[WARM_UP:] for group in zip(*samples)]
    line = statistics.linear_regression(*zip(*calls))
    return {"call": round(line.intercept, 8), "mib": round(line.slope, 7)}


def formatted(results):
    """JSON with each list of numbers, and each object of such lists or of numbers, in a line."""
    text = json.dumps(results, indent=1)
    for pattern, ends in ((r"\[\s+([-\d.e,\s]+?)\s+\]", "[]"), (r"\{\s+([^{}]{1,150}?)\s+\}", "{}")):
        text = re.sub(pattern, lambda m: ends[0] + re.sub(r",\s+", ", ", m[1]) + ends[1], text)
    return text


def main(program, scene, size, processes, samples, results):
    with tempfile.TemporaryDirectory() as folder:
        run(program, scene, size, int(processes), int(samples), folder)
        ranks = [samples_of(os.path.join(folder, f"calls.{r}")) for r in range(int(processes))]
        packing = [packing_seconds(os.path.join(folder, f"perf.{r}"), [s[-1].clock for s in ranks[r]])
                   for r in range(int(processes))]
    with open(results) as file:
        everything = json.load(file)
    name = os.path.splitext(os.path.basename(scene))[0]
    entry = {"mib": [round(sum(c.bytes for c in s) / 2**20, 3) for s in ranks[0]]}
    entry["warm_up"] = summary(ranks, packing, 1, min(WARM_UP, len(ranks[0])))
    if len(ranks[0]) > WARM_UP + 1:
        entry["reduction_seconds"] = call_seconds(ranks)
        entry["later"] = summary(ranks, packing, WARM_UP, len(ranks[0]))
    everything.setdefault("processes", {}).setdefault(name, {}).setdefault(size, {})[processes] = entry
    with open(results, "w") as file:
        file.write(formatted(everything) + "\n")
    print({k: v for k, v in entry.items() if k != "mib"}, "MiB at most", max(entry["mib"][WARM_UP:], default=0))


if __name__ == "__main__":
    if len(sys.argv) != 7:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
