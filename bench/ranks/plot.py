#!/usr/bin/env python3
"""Draws the three figures of docs/ranks.md: how ranks work, what they send, and how they scale.

usage: bench/ranks/plot.py bench/results/ranks.json FOLDER

FOLDER receives ranks-how.svg, ranks-traffic.svg and ranks-scaling.svg. Scenes, sizes and numbers of ranks are those of
the file: "processes" as measure.py writes them, "gpus" as gpus.py does.
"""
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

from svg import COLOURS, Plot, document, line, text

WARM_UP = 32
MOST_RANKS = 1024
NETWORK = {"call": 5.0e-6, "mib": 2**20 / 12.5e9}  # seconds, of an assumed network of 100 Gbit/s
WAVE = 24  # samples that end together, by default
ARROW_TIP = ("<defs><marker id='tip' viewBox='0 0 8 8' refX='7' refY='4' markerWidth='8' markerHeight='8' orient='auto'>"
             "<path d='M0 0 L8 4 L0 8 z' fill='#555'/></marker></defs>")


def box(x, y, width, height, fill, *lines):
    parts = [f"<rect x='{x}' y='{y}' width='{width}' height='{height}' rx='5' fill='{fill}' stroke='#888'/>"]
    for i, content in enumerate(lines):
        middle = y + height / 2 + 5 + 17 * (i - (len(lines) - 1) / 2)
        parts.append(text(x + width / 2, middle, content, "text-anchor='middle'"))
    return parts


def write(path, width, height, parts):
    with open(path, "w") as file:
        file.write(document(width, height, [ARROW_TIP, *parts]))


def draw_how(path):
    parts = []
    columns = [("rank 0", 20), ("rank 1", 200), ("rank n - 1", 400)]
    for name, x in columns:
        parts.append(text(x + 75, 24, name, "text-anchor='middle' font-weight='bold'"))
        parts += box(x, 36, 150, 50, "#fde9d9", "traces its part", "of the sample's paths")
        parts += box(x, 116, 150, 50, "#fff6d6", "sums what they found", "as integers")
        parts += box(x, 256, 150, 50, "#e0f0e4", "learns from the sums:", "all guides are equal")
        for y0, y1 in ((86, 114), (166, 194), (228, 254)):
            parts.append(line(x + 75, y0, x + 75, y1, "stroke='#555' stroke-width='1.4' marker-end='url(#tip)'"))
    parts += box(20, 196, 530, 32, "#dbe8f5", "communicator: sums and maxima over all ranks (threads, MPI, NCCL)")
    parts += [text(375, y, "...", "text-anchor='middle' font-size='20'") for y in (64, 144, 284)]
    parts.append("<path d='M 550 281 H 580 V 61 H 553' fill='none' stroke='#555' stroke-width='1.4' "
                 "marker-end='url(#tip)'/>")
    parts.append(text(0, 0, "next sample", "text-anchor='middle' transform='translate(597 171) rotate(-90)'"))
    write(path, 610, 322, parts)


def draw_traffic(results, path):
    """MiB of each sample. All numbers of ranks above 1 send as much, so that of the most samples is drawn."""
    plots = [(scene, size, max((run["mib"] for n, run in runs.items() if int(n) > 1), key=len))
             for scene, sizes in results["processes"].items() for size, runs in sizes.items() if "x" in size]
    sizes = sorted({size for _, size, _ in plots}, key=lambda size: -int(size.split("x")[0]))
    parts = []
    for column, size in enumerate(sizes):
        series = [(scene, mib) for scene, of_size, mib in plots if of_size == size]
        last = max(len(mib) for _, mib in series)
        plot = Plot(58 + 370 * column, 42, 320, 210, (1, last), (0.01, 20), [1, *range(8, last + 1, 8)],
                    (0.01, 0.1, 1, 10), f"{size.replace('x', ' × ')}", "sample")
        plot.parts.append(line(plot.x(WARM_UP + 0.5), plot.top, plot.x(WARM_UP + 0.5), plot.top + plot.height,
                               "stroke='#999' stroke-dasharray='3 4'"))
        plot.parts.append(line(plot.left, plot.y(8), plot.left + plot.width, plot.y(8), "stroke='#c0392b' stroke-dasharray='6 3'"))
        plot.label(plot.left + plot.width - 40, plot.y(8) - 4, "8 MiB", "#c0392b")
        for i, (scene, mib) in enumerate(series):
            plot.dots([(k + 1, value) for k, value in enumerate(mib)], COLOURS[i])
            plot.label(plot.left + 8 + 70 * i, plot.top + plot.height - 10, scene, COLOURS[i])
        plot.label(plot.x(WARM_UP + 0.5) - 72, plot.top + plot.height - 10, "warm-up", "#777")
        parts += plot.parts
    parts.append(text(0, 0, "MiB a sample a rank", "text-anchor='middle' transform='translate(16 147) rotate(-90)'"))
    write(path, 58 + 370 * len(sizes), 300, parts)


def reduction(ranks, part, costs):
    """Modelled seconds of a sample's reductions: latency of each call, and both passes of its bytes."""
    if ranks == 1:
        return 0.0
    return part["calls"] * costs["call"] * math.log2(ranks) + 2 * (ranks - 1) / ranks * part["mib"] * costs["mib"]


def work(part):
    return part["all"] - part["reducing"] - part["packing"]


def fit(seconds):
    """The seconds that ranks divide and those of each rank alone, from seconds by number of ranks. Least squares of
    (divided / n + alone) / seconds - 1."""
    sums = [0.0] * 5
    for n, measured in seconds.items():
        u, v = 1 / n / measured, 1 / measured
        sums = [a + b for a, b in zip(sums, (u * u, u * v, v * v, u, v))]
    uu, uv, vv, u, v = sums
    alone = max((uu * v - uv * u) / (uu * vv - uv * uv), 0.0)
    return (u - uv * alone) / uu, alone


class Model:
    """Seconds of a sample on one rank of n: what is divided, what each rank does alone, packing, and reductions. The
    first two fit the work of all measured numbers of ranks, with equal relative errors. Costs of packing and of
    reductions are those between two ranks."""

    def __init__(self, runs):
        self.part = runs["2"]["later"]
        self.costs = runs["2"]["reduction_seconds"]
        self.divided, self.alone = fit({int(n): work(run["later"]) for n, run in runs.items() if "later" in run})

    def seconds(self, ranks, costs, samples=1):
        packing = self.part["packing"] if ranks > 1 else 0.0
        return self.divided * samples / ranks + self.alone + packing + reduction(ranks, self.part, costs)


def models(results):
    for scene, sizes in results["processes"].items():
        for size, runs in sizes.items():
            if "1" in runs and "2" in runs and "later" in runs["1"] and "later" in runs["2"]:
                yield scene, size, runs, Model(runs)


def gpu_series(results):
    """Scene, split and mean seconds by number of GPUs."""
    for scene, splits in results.get("gpus", {}).get("scenes", {}).items():
        for split in ("samples", "tiles"):
            runs = {int(n): sum(s) / len(s) for n, s in sorted(splits.get(split, {}).items(), key=lambda item: int(item[0]))}
            if len(runs) > 1:
                yield scene, split, runs


def draw_scaling(results, path):
    ranks = [2**k for k in range(int(math.log2(MOST_RANKS)) + 1)]
    ticks = (1, 2, 4, 8, 16, 64, 256, 1024)
    speed = Plot(58, 42, 330, 260, (1, MOST_RANKS), (0.8, MOST_RANKS), ticks, (1, 2, 4, 8, 16, 64, 256, 1024),
                 "speed against one rank", "ranks", True)
    cost = Plot(470, 42, 330, 260, (1, MOST_RANKS), (1.0e-2, 100), ticks, (0.01, 0.1, 1, 10, 100),
                "ms of reductions a sample", "ranks", True)
    speed.curve([(n, n) for n in (1, MOST_RANKS)], "#cccccc")
    i = 0
    for scene, size, runs, model in models(results):
        colour = COLOURS[i % len(COLOURS)]
        points = sorted((int(n), run["later"]) for n, run in runs.items() if "later" in run)
        whole = points[0][1]["all"]
        speed.dots([(n, whole / part["all"]) for n, part in points], colour)
        for samples, dashes in ((1, ""), (WAVE, "stroke-dasharray='6 4'")):
            base = model.seconds(1, NETWORK, samples)
            speed.curve([(n, base / model.seconds(n, NETWORK, samples)) for n in ranks], colour, dashes)
        cost.dots([(n, 1.0e3 * part["reducing"]) for n, part in points if n > 1], colour)
        cost.curve([(n, 1.0e3 * reduction(n, model.part, model.costs)) for n in ranks[1:]], colour)
        cost.curve([(n, 1.0e3 * reduction(n, model.part, NETWORK)) for n in ranks[1:]], colour, "stroke-dasharray='2 3'")
        speed.label(66, 56 + 16 * i, f"{scene} {size.replace('x', ' × ')}", colour)
        i += 1
    for scene, split, runs in gpu_series(results):
        colour = COLOURS[i % len(COLOURS)]
        speed.dots([(n, runs[1] / seconds) for n, seconds in runs.items()], colour, False)
        speed.label(66, 56 + 16 * i, f"{scene}, GPUs, {split}", colour)
        i += 1
    cost.label(478, 56, "dots: measured; lines: model, this machine", "#555")
    cost.label(478, 72, "dotted: model, 5 µs and 100 Gbit/s", "#555")
    speed.parts.append(text(58, 362, f"lines: model, 5 µs and 100 Gbit/s; dashed: {WAVE} samples a wave", "fill='#555' font-size='12'"))
    write(path, 820, 376, speed.parts + cost.parts)


def print_model(results):
    """The model beside what was measured, for the page's table."""
    for scene, size, runs, model in models(results):
        print(f"{scene} {size}: {1e3 * model.divided:.1f} ms divided, {1e3 * model.alone:.1f} ms alone")
        for n, run in sorted(runs.items(), key=lambda item: int(item[0])):
            if "later" in run:
                part = run["later"]
                print(f"  {n}: {1e3 * part['all']:.1f} ms, model {1e3 * model.seconds(int(n), model.costs):.1f}; reductions "
                      f"{1e3 * part['reducing']:.2f} ms, model {1e3 * reduction(int(n), part, model.costs):.2f}; "
                      f"packing {1e3 * part['packing']:.2f} ms")
    for scene, split, runs in gpu_series(results):
        divided, alone = fit(runs)
        print(f"{scene}, GPUs, {split}: {divided:.2f} s divided, {alone:.2f} s alone")
        for n, seconds in runs.items():
            print(f"  {n}: {seconds:.2f} s, model {divided / n + alone:.2f}; {runs[1] / seconds:.2f} times as fast as one")


def main(source, folder):
    with open(source) as file:
        results = json.load(file)
    draw_how(os.path.join(folder, "ranks-how.svg"))
    draw_traffic(results, os.path.join(folder, "ranks-traffic.svg"))
    draw_scaling(results, os.path.join(folder, "ranks-scaling.svg"))
    print_model(results)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
