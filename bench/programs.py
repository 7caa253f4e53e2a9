"""Runs the renderer's programs, and writes results. Shared by the scripts beside it."""
import json
import os
import subprocess
import sys


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

    def compare(self, name, reference):
        pictures = [os.path.join(self.folder, n + ".exr") for n in (name, reference)]
        command = [os.path.join(self.directory, "wfpg-compare"), *pictures, "--json"]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


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
    with open(out, "w") as file:
        json.dump({**results, **head}, file, indent=1)
        file.write("\n")
