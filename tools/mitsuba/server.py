"""Renders by Mitsuba 3 what lines of standard input ask for. usage: server.py VARIANT THREADS SCENE.xml SIZE DEPTH

A line is the JSON object {"samples": N, "seed": S, "picture": PATH or null}. The answer is one line, too: wall and CPU seconds of
mitsuba.render. Before the first, one line has the versions. Runs in a process of its own, since a variant may end it.
"""
import array
import json
import sys
import time

sys.dont_write_bytecode = True

import drjit  # noqa: E402
import mitsuba  # noqa: E402
from exr_file import Picture, write_exr  # noqa: E402, PYTHONPATH has its folder


def rows(values: "array.array[float]", width: int) -> "list[list[array.array[float]]]":
    """Rows of channels from interleaved RGB."""
    return [[values[at + channel:at + 3 * width:3] for channel in range(3)] for at in range(0, len(values), 3 * width)]


def main(variant: str, threads: str, path: str, size: str, depth: str) -> None:
    answers = sys.stdout
    sys.stdout = sys.stderr  # Mitsuba's messages
    drjit.set_thread_count(int(threads))
    mitsuba.set_variant(variant)
    width, height = size.split("x")
    scene = mitsuba.load_file(path, width=width, height=height, depth=depth)
    print(json.dumps({"mitsuba": mitsuba.__version__, "drjit": drjit.__version__}), file=answers, flush=True)
    for line in sys.stdin:
        asked = json.loads(line)
        wall, cpu = time.perf_counter(), time.process_time()
        picture = mitsuba.render(scene, spp=asked["samples"], seed=asked["seed"])
        if not variant.startswith("scalar"):
            drjit.eval(picture)
            drjit.sync_thread()
        times = {"seconds": time.perf_counter() - wall, "cpu_seconds": time.process_time() - cpu}
        if asked["picture"]:
            values = array.array("f", list(picture.array))
            write_exr(asked["picture"], Picture(int(width), rows(values, int(width))))
        print(json.dumps(times), file=answers, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
