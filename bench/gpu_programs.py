"""Runs the renderer's programs on the GPU, and writes results for bench/table.py. Shared by the scripts beside it."""
import json
import os
import subprocess
import sys


class Programs:
    """Programs in `directory`. They write pictures and statistics to `folder`."""

    def __init__(self, directory, size, folder):
        self.directory, self.size, self.folder = directory, size, folder

    def render(self, scene, name, arguments):
        """Renders to NAME.exr and returns the statistics."""
        picture, stats = (os.path.join(self.folder, name + ending) for ending in (".exr", ".json"))
        command = [os.path.join(self.directory, "wfpg-render"), scene, "--device", "cuda", "--size", self.size]
        subprocess.run([*command, *arguments, "-o", picture, "--stats", stats], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(stats) as file:
            return json.load(file)

    def compare(self, name, reference):
        pictures = [os.path.join(self.folder, n + ".exr") for n in (name, reference)]
        command = [os.path.join(self.directory, "wfpg-compare"), *pictures, "--json"]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def write_results(out, results):
    """With the command that made them, and the GPU."""
    gpu = subprocess.run(["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"],
                         check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    with open(out, "w") as file:
        json.dump({"command": " ".join(sys.argv), "gpu_and_driver": gpu, **results}, file, indent=1)
        file.write("\n")
