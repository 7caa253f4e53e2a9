"""Runs the renderer's programs, and writes results. Shared by the scripts beside it."""
import json
import os
import statistics
import subprocess
import sys

PAIRS = ((1, 2), (3, 4))  # of seeds, whose pictures are compared
SEEDS = [seed for pair in PAIRS for seed in pair]
ERRORS = ("mse", "relmse", "relmse_trimmed", "mse_reinhard")  # of those that wfpg-compare prints


class Programs:
    """Programs in `directory`. They write pictures and statistics to `folder`."""

    def __init__(self, directory, size, folder, device="cuda"):
        self.directory, self.size, self.folder, self.device = directory, size, folder, device

    def render(self, scene, name, arguments):
        """Renders to NAME.exr and returns the statistics."""
        picture, stats = (os.path.join(self.folder, name + ending) for ending in (".exr", ".json"))
        command = [os.path.join(self.directory, "wfpg-render"), scene, "--device", self.device, "--size", self.size]
        subprocess.run([*command, *arguments, "-o", picture, "--stats", stats], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(stats) as file:
            return json.load(file)

    def variance(self, name):
        """Variance of pictures NAME and a seed: half of the mean difference of two seeds' pictures."""
        return statistics.mean(self.compare(f"{name}{a}", f"{name}{b}")["mse_reinhard"] for a, b in PAIRS) / 2

    def compare(self, name, reference):
        pictures = [os.path.join(self.folder, n + ".exr") for n in (name, reference)]
        command = [os.path.join(self.directory, "wfpg-compare"), *pictures, "--json"]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def errors_without_noise(errors, noise):
    """Mean errors of one picture against two references, less half the references' difference, which is their noise."""
    return {kind: statistics.mean(error[kind] for error in errors) - noise[kind] / 2 for kind in ERRORS}


def is_hidden(error, noise):
    """Whether an error without noise is too small for what the references differ by."""
    return not error > noise / 20


def seconds(stats):
    """A rendering's time, without what stands before all methods."""
    return stats["seconds"]["total"] - stats["seconds"].get("embree", 0.0) - stats["seconds"].get("bvh", 0.0)


def milliseconds_a_sample(first, last, samples, stages):
    """By stage and in all: of the samples that one rendering has more than another, from the statistics of both."""
    line = {s: 1e3 * (last["seconds"].get(s, 0.0) - first["seconds"].get(s, 0.0)) / samples for s in stages}
    return {**line, "total": sum(line.values())}


def medians(lines):
    """Of dictionaries with the same keys, by key."""
    return {key: statistics.median(line[key] for line in lines) for key in lines[0]}


def unguided_options(options):
    """Those of a scene's options that path tracing has, too."""
    return [] if "--light-groups" in options else options


def renderings_at_once():
    """How many renderings of one thread run beside each other: two cores stay free."""
    return max(1, len(os.sched_getaffinity(0)) - 2)


def begin_results(out):
    """What OUT holds so far. Fails before minutes of work where it cannot be written."""
    with open(out, "a+") as file:
        file.seek(0)
        return json.loads(file.read() or "{}")


def gpu_and_driver():
    """The GPU's name and its driver's version; empty without a GPU."""
    try:
        return subprocess.run(["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"], check=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def write_results(out, results, part=""):
    """With the command that made them, or a `part` of them, and the GPU if there is one."""
    gpu = gpu_and_driver()
    command = " ".join([os.path.basename(sys.argv[0]), *sys.argv[1:]])
    head = {f"{part}_command" if part else "command": command, **({"gpu_and_driver": gpu} if gpu else {})}
    with open(out + ".new", "w") as file:
        json.dump({**results, **head}, file, indent=1)
        file.write("\n")
    os.replace(out + ".new", out)  # an interrupted run loses nothing
