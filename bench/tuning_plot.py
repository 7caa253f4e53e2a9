#!/usr/bin/env python3
"""Draws the results of bench/tuning.py: the error over each option, one plot per option.

usage: bench/tuning_plot.py bench/results/tuning.json OUT.svg
"""
import json
import math
import sys

from svg import document, line, text

COLUMNS = 3
LEFT, TOP, RIGHT, BOTTOM = 70, 62, 16, 30  # of all plots
WIDTH, HEIGHT, GAP_X, GAP_Y = 220, 130, 22, 62  # of a plot
COLOURS = ("#d95f02", "#1b6ca8")


class ErrorAxis:
    """Logarithmic, the same of all plots, from a 1, 2 or 5 times a power of ten to another."""

    def __init__(self, errors):
        ticks = [d * 10.0**p for p in range(-8, 3) for d in (1, 2, 5)]
        first = max(i for i, t in enumerate(ticks) if t <= min(errors))
        last = min(i for i, t in enumerate(ticks) if t >= max(errors))
        self.ticks = ticks[first:last + 1]

    def at(self, error, top):
        low, high = math.log(self.ticks[0]), math.log(self.ticks[-1])
        return top + HEIGHT * (high - math.log(error)) / (high - low)


def draw_curve(scene, points, xs, axis, top, colour):
    """A point a value, with one standard error to both sides; the default's is filled."""
    parts = []
    path = " ".join(f"{x:.1f},{axis.at(p['scenes'][scene]['error'], top):.1f}" for x, p in zip(xs, points))
    parts.append(f"<polyline fill='none' stroke-width='2' stroke='{colour}' points='{path}'/>")
    for x, point in zip(xs, points):
        error, deviation = (point["scenes"][scene][key] for key in ("error", "standard_error"))
        ends = [axis.at(max(e, axis.ticks[0]), top) for e in (error - deviation, error + deviation)]
        parts.append(line(x, ends[0], x, ends[1], f"stroke='{colour}'"))
        fill = colour if point["is_default"] else "white"
        parts.append(f"<circle cx='{x:.1f}' cy='{axis.at(error, top):.1f}' r='3.5' fill='{fill}' stroke='{colour}' "
                     "stroke-width='1.5'/>")
    return parts


def draw_plot(option, points, results, axis, left, top, has_labels):
    parts = [text(left, top - 10, option, "font-weight='bold'")]
    for tick in axis.ticks:
        y = axis.at(tick, top)
        parts.append(line(left, y, left + WIDTH, y, "stroke='#e4e4e4'"))
        if has_labels:
            parts.append(text(left - 6, y + 4, f"{tick:g}", "text-anchor='end' font-size='11'"))
    xs = [left + WIDTH * (i + 0.5) / len(points) for i in range(len(points))]
    for x, point in zip(xs, points):
        parts.append(text(x, top + HEIGHT + 16, point["value"], "text-anchor='middle' font-size='11'"))
    for scene, colour in zip(results["path_tracing"], COLOURS):
        y = axis.at(results["path_tracing"][scene], top)
        parts.append(line(left, y, left + WIDTH, y, f"stroke='{colour}' stroke-dasharray='3 4'"))
        parts += draw_curve(scene, points, xs, axis, top, colour)
    return parts


def draw_legend(results):
    parts, x = [], LEFT
    for scene, colour in zip(results["path_tracing"], COLOURS):
        parts.append(text(x, 22, scene, f"fill='{colour}' font-weight='bold'"))
        x += 8 * len(scene) + 16
    parts.append(text(x, 22, "dashed: path tracing; filled: the default", "fill='#555'"))
    return parts


def draw(results):
    errors = list(results["path_tracing"].values())
    errors += [s["error"] for points in results["options"].values() for p in points for s in p["scenes"].values()]
    axis = ErrorAxis(errors)
    rows = math.ceil(len(results["options"]) / COLUMNS)
    width = LEFT + COLUMNS * WIDTH + (COLUMNS - 1) * GAP_X + RIGHT
    height = TOP + rows * HEIGHT + (rows - 1) * GAP_Y + BOTTOM
    parts = draw_legend(results)
    for i, (option, points) in enumerate(results["options"].items()):
        left, top = LEFT + i % COLUMNS * (WIDTH + GAP_X), TOP + i // COLUMNS * (HEIGHT + GAP_Y)
        parts += draw_plot(option, points, results, axis, left, top, i % COLUMNS == 0)
    parts.append(text(0, 0, "MSE after c / (1 + c)",
                      f"text-anchor='middle' transform='translate(14 {(TOP + height - BOTTOM) / 2}) rotate(-90)'"))
    return document(width, height, parts)


def main(source, out):
    with open(source) as file:
        results = json.load(file)
    with open(out, "w") as file:
        file.write(draw(results))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
