#!/usr/bin/env python3
"""Draws the plots of docs/quality.md: gains beside the peers', errors over time, and single samples.

usage: bench/quality_plots.py bench/results FOLDER

FOLDER receives gains.svg, error-over-time.svg and single-samples.svg. Errors are the MSE after c / (1 + c), without the
references' noise, and means over seeds. A gain is path tracing's error over the method's.
"""
import json
import math
import pathlib
import sys
from typing import Any, Dict, Iterable, List, Tuple

from svg import COLOURS, Plot, document, line, text
from table import errors_at, three

MEASURE = "mse_reinhard"
FIRST_SAMPLES = 4  # of curves; before that all methods are alike
ORANGE, BLUE, GREEN, PURPLE, GOLD, GREY = COLOURS

Scene = Dict[str, Any]
Errors = Dict[str, Dict[str, float]]
Points = List[Tuple[float, float]]


def scenes_of(folder: pathlib.Path, *names: str) -> List[Scene]:
    """The scenes of result files of wfpg-quality."""
    return [scene for name in names for scene in json.loads((folder / name).read_text(encoding="utf-8"))["scenes"]]


def short(scene: Scene) -> str:
    """A scene's name without its folder, ending and options."""
    return scene["scene"].split("/")[-1].split(" ")[0].replace(".glb", "")


# --- gains -----------------------------------------------------------------------------------------------------------

class Group:
    """Bars of one scene: gains with a colour each. Pale ones are drawn lighter. Each name has a line below."""

    def __init__(self, names: Iterable[str], bars: Iterable[Tuple[float, str, bool]]) -> None:
        self.names, self.bars = list(names), list(bars)


class Bars:
    """A panel of groups of bars, from the line of path tracing up where a method gains, and down where it loses."""

    def __init__(self, left: float, top: float, width: float, height: float, ends: Tuple[float, float], title: str) -> None:
        ticks = [t for t in (0.5, 1, 2, 5, 10, 20) if ends[0] <= t <= ends[1]]
        self.plot = Plot(left, top, width, height, (0, 1), ends, (), ticks, "", "")
        self.plot.parts.append(text(left, top - 32, title, "font-weight='bold'"))
        self.bottom = top + height

    def legend(self, items: Iterable[Tuple[str, str, bool]]) -> None:
        """Names of bars, below the title."""
        x = self.plot.left
        for name, colour, is_pale in items:
            self.plot.parts.append(f"<rect x='{x:.1f}' y='{self.plot.top - 23}' width='11' height='11' fill='{colour}' "
                                   f"opacity='{0.45 if is_pale else 1}'/>")
            self.plot.label(x + 16, self.plot.top - 13, name, "#333")
            x += 34 + 6.4 * len(name)

    def draw(self, groups: List[Group]) -> List[str]:
        """All groups, with the gain at the end of each bar."""
        width = self.plot.width / len(groups)
        base = self.plot.y(1)
        for i, group in enumerate(groups):
            bar = min(34.0, 0.84 * width / len(group.bars))
            middle = self.plot.left + (i + 0.5) * width
            for k, (value, colour, is_pale) in enumerate(group.bars):
                x, end = middle + (k - len(group.bars) / 2) * bar, self.plot.y(value)
                self.plot.parts.append(f"<rect x='{x + 1:.1f}' y='{min(base, end):.1f}' width='{bar - 2:.1f}' "
                                       f"height='{max(abs(base - end), 0.5):.1f}' fill='{colour}' opacity='{0.45 if is_pale else 1}'/>")
                y = end - 4 if value >= 1 else end + 12
                self.plot.parts.append(text(x + bar / 2, y, three(value), "text-anchor='middle' font-size='10' fill='#333'"))
            for k, name in enumerate(group.names):
                look = "font-size='12'" if k == 0 else "font-size='11' fill='#555'"
                self.plot.parts.append(text(middle, self.bottom + 16 + 14 * k, name, f"text-anchor='middle' {look}"))
        self.plot.parts.append(line(self.plot.left, base, self.plot.left + self.plot.width, base, "stroke='#333'"))
        return self.plot.parts


def gain(errors: Errors, method: str, measure: str = MEASURE) -> float:
    """Path tracing's error over the method's."""
    return errors["pt"][measure] / errors[method][measure]


def equal_time(errors: Errors, method: str, measure: str = MEASURE) -> float:
    """The gain where both take as long: errors fall with the inverse of time."""
    return gain(errors, method, measure) * errors["pt"]["seconds"] / errors[method]["seconds"]


def last_gain(scene: Scene, method: str) -> float:
    """A method's gain at the scene's last budget."""
    return gain(errors_at({"summary": scene["summary"]}, scene["summary"][-1]["budget"]), method)


def openpgl_group(scene: Scene) -> Group:
    """wfpg and Open PGL after 256 samples, and at equal time."""
    errors = errors_at(scene, "256 samples")
    bars = []
    for method, colour in (("wfpg", BLUE), ("vmm-1000", ORANGE)):
        bars += [(gain(errors, method), colour, False), (equal_time(errors, method), colour, True)]
    return Group([short(scene)], bars)


def last_group(scene: Scene, methods: Dict[str, Tuple[str, bool]], *more: str) -> Group:
    """Gains at the last budget, below them the scene's name and more lines."""
    return Group([short(scene), *more], [(last_gain(scene, method), *look) for method, look in methods.items()])


def draw_gains(folder: pathlib.Path) -> str:
    """Bars of gains: Open PGL, guides without next-event estimation, records, and the paper's own method."""
    rates = {"wfpg": (BLUE, False), "sarsa-hemisphere": (ORANGE, False), "monte-carlo-hemisphere": (GOLD, False), "records": (GREEN, False)}
    parts: List[str] = []
    panel = Bars(46, 58, 800, 170, (0.5, 36), "Beside Open PGL: 256 samples, with next-event estimation")
    panel.legend([("wfpg, equal samples", BLUE, False), ("wfpg, equal time", BLUE, True),
                  ("Open PGL, equal samples", ORANGE, False), ("Open PGL, equal time", ORANGE, True)])
    parts += panel.draw([openpgl_group(s) for s in scenes_of(folder, "quality-openpgl.json")])

    panel = Bars(46, 316, 800, 150, (0.7, 24), "Beside other guides: one second on a GPU, without next-event estimation")
    panel.legend([("wfpg", BLUE, False), ("SARSA", ORANGE, False), ("Monte Carlo", GOLD, False), ("irradiance records", GREEN, False)])
    parts += panel.draw([last_group(s, rates) for s in scenes_of(folder, "quality-sarsa.json", "quality-sarsa-more.json")])

    panel = Bars(46, 556, 480, 150, (0.7, 32), "Beside records: 30 samples; next-event estimation on or off")
    panel.legend([("wfpg", BLUE, False), ("SARSA", ORANGE, False), ("irradiance records", GREEN, False)])
    found = sorted(scenes_of(folder, "quality-records.json"), key=lambda s: short(s) != "cornell-wall")
    looks = {"wfpg": (BLUE, False), "sarsa": (ORANGE, False), "records": (GREEN, False)}
    parts += panel.draw([last_group(s, looks, "off" if "--nee off" in s["scene"] else "on") for s in found])

    panel = Bars(586, 556, 260, 150, (0.5, 20), "Beside the paper's method")
    panel.legend([("wfpg", BLUE, False), ("product", BLUE, True), ("paper", PURPLE, False), ("product", PURPLE, True)])
    looks = {"wfpg": (BLUE, False), "wfpg-product": (BLUE, True), "paper": (PURPLE, False), "paper-product": (PURPLE, True)}
    found = scenes_of(folder, "quality-paper-veach-ajar.json", "quality-paper-bathroom.json")
    parts += panel.draw([last_group(s, looks, s["summary"][-1]["budget"]) for s in found])
    return document(866, 748, parts)


# --- errors over time ------------------------------------------------------------------------------------------------

def error_curve(scene: Scene, method: str) -> Points:
    """Seconds and error after 4, 8, 16, ... samples."""
    counts = sorted({p["samples"] for run in scene["runs"] for p in run["points"]})
    found = [errors_at(scene, f"{n} samples")[method] for n in counts if n >= FIRST_SAMPLES]
    return [(f["seconds"], f[MEASURE]) for f in found if f[MEASURE] > 0]


def nice_ends(values: List[float]) -> Tuple[float, float]:
    """Numbers 1, 2 or 5 times a power of ten around all values."""
    steps = [d * 10.0**p for p in range(-9, 5) for d in (1, 2, 5)]
    return max(s for s in steps if s <= min(values)), min(s for s in steps if s >= max(values))


def ticks_between(ends: Tuple[float, float]) -> List[float]:
    """Powers of ten, or numbers 1, 2 and 5 times one where there are fewer than two powers."""
    powers = [10.0**p for p in range(-9, 5)]
    found = [t for t in powers if ends[0] <= t <= ends[1]]
    steps = [d * t for t in powers for d in (1, 2, 5)]
    return found if len(found) > 1 else [s for s in steps if ends[0] * 0.999 <= s <= ends[1] * 1.001]


def draw_errors_of(scene: Scene, methods: Dict[str, Tuple[str, str]], left: float, top: float) -> List[str]:
    """A plot of one scene."""
    curves = {method: error_curve(scene, method) for method in methods}
    points = [p for curve in curves.values() for p in curve]
    xs, ys = nice_ends([x for x, _ in points]), nice_ends([y for _, y in points])
    plot = Plot(left, top, 212, 130, xs, ys, [int(t) if t >= 1 else t for t in ticks_between(xs)], ticks_between(ys), short(scene), "", True)
    plot.parts += [line(plot.x(x), top, plot.x(x), top + 130, "stroke='#e4e4e4'") for x in ticks_between(xs)]
    plot.parts += [line(left, top + 130, left + 212, top + 130, "stroke='#999'"), line(left, top, left, top + 130, "stroke='#999'")]
    for method, curve in curves.items():
        plot.curve(curve, methods[method][1])
        plot.dots(curve, methods[method][1], radius=2.4)
    return plot.parts


def draw_error_over_time(folder: pathlib.Path) -> str:
    """Errors over seconds: the built-in scenes, and those of the literature beside Open PGL."""
    series = (("builtin-scenes.json", "Built-in scenes, two cores, to 64 samples",
               {"pt": ("path tracing", GREY), "wfpg-transient-oriented": ("wfpg, transient", GOLD), "wfpg": ("wfpg", BLUE),
                "wfpg-product": ("wfpg-product", GREEN)}),
              ("quality-openpgl.json", "Scenes of the literature, fifteen cores, to 256 samples",
               {"pt": ("path tracing", GREY), "vmm-1000": ("Open PGL", ORANGE), "wfpg": ("wfpg", BLUE)}))
    parts: List[str] = []
    for block, (name, title, methods) in enumerate(series):
        scenes, top = scenes_of(folder, name), 60 + 408 * block
        parts.append(text(14, top - 38, title, "font-weight='bold' fill='#555'"))
        for i, scene in enumerate(scenes):
            parts += draw_errors_of(scene, methods, 66 + 276 * (i % 3), top + 184 * (i // 3))
        left, y = 66 + 276 * 2, top + 184
        for k, (method, colour) in enumerate(methods.values()):
            parts.append(line(left, y + 20 * k + 10, left + 24, y + 20 * k + 10, f"stroke='{colour}' stroke-width='3'"))
            parts.append(text(left + 32, y + 20 * k + 14, method, f"fill='{colour}'"))
        parts.append(text(left, y + 20 * len(methods) + 14, "error (MSE) over seconds; a dot after 4,", "fill='#555' font-size='11'"))
        parts.append(text(left, y + 20 * len(methods) + 30, "8, 16, ... samples", "fill='#555' font-size='11'"))
    return document(860, 816, parts)


# --- single samples --------------------------------------------------------------------------------------------------

def draw_single_samples(folder: pathlib.Path) -> str:
    """Each sample's own error over path tracing's, and combined samples' over that of the plain mean."""
    alone = {"pt": ("path tracing", GREY), "paper": ("the paper's method", PURPLE), "wfpg-transient-oriented": ("transient, oriented", GOLD),
             "wfpg": ("kept, oriented", BLUE)}
    ways = {"constant": GREY, "discard-first": PURPLE, "linear": ORANGE, "quadratic": GOLD, "one-two": GREEN, "pt-linear": BLUE}
    parts: List[str] = []
    for row, scene in enumerate(scenes_of(folder, "quality-series.json")):
        found, noise, top = scene["single_samples"], scene["reference"]["noise"][MEASURE], 46 + 270 * row
        pt = found["pt"]["alone"][MEASURE]
        mean = sum(pt) / len(pt) - noise
        one = Plot(58, top, 350, 190, (1, len(pt)), (0.53, 1.15), (1, 2, 4, 8, 16, 32, 64), (0.6, 0.7, 0.8, 0.9, 1, 1.1),
                   f"{short(scene)}: each sample alone", "sample", True, False)
        for method, (_, colour) in alone.items():
            one.curve([(i + 1, (e - noise) / mean) for i, e in enumerate(found[method]["alone"][MEASURE])], colour)
        for k, (name, colour) in enumerate(alone.values()):
            one.label(one.left + 70 + 130 * (k % 2), one.top + one.height - 24 + 15 * (k // 2), name, colour)
        all_ways = found["wfpg"]["combined"]
        plain = all_ways["constant"][MEASURE]
        other = Plot(476, top, 350, 190, (1, len(plain)), (0.88, 1.22), (1, 2, 4, 8, 16, 32, 64), (0.9, 0.95, 1, 1.05, 1.1, 1.15, 1.2),
                     f"{short(scene)}: samples of kept fields combined", "samples", True, False)
        for way, colour in ways.items():
            errors = zip(all_ways[way][MEASURE], plain)
            other.curve([(i + 1, (e - noise) / (p - noise)) for i, (e, p) in enumerate(errors) if e is not None], colour)
        for k, (way, colour) in enumerate(ways.items()):
            other.label(other.left + 160 + 100 * (k % 2), other.top + 14 + 15 * (k // 2), way, colour)
        parts += one.parts + other.parts
    parts.append(text(0, 0, "error over path tracing's", "text-anchor='middle' fill='#555' transform='translate(16 276) rotate(-90)'"))
    parts.append(text(0, 0, "error over the plain mean's", "text-anchor='middle' fill='#555' transform='translate(436 276) rotate(-90)'"))
    return document(846, 556, parts)


def main(source: str, folder: str) -> None:
    """Draws all plots."""
    plots = {"gains.svg": draw_gains, "error-over-time.svg": draw_error_over_time, "single-samples.svg": draw_single_samples}
    for name, draw in plots.items():
        (pathlib.Path(folder) / name).write_text(draw(pathlib.Path(source)), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
