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
from typing import Any, Dict, Iterable, List, NamedTuple, Tuple

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

class Look(NamedTuple):
    """How a method's bars look. Pale ones are drawn lighter."""
    name: str
    colour: str
    is_pale: bool = False


class Group(NamedTuple):
    """A scene's gains, one for each look, and the lines below them."""
    lines: List[str]
    gains: List[float]


class Place(NamedTuple):
    """Of a panel, in pixels."""
    left: float
    top: float
    width: float
    height: float


def rectangle(x: float, y: float, width: float, height: float, look: Look) -> str:
    """A bar."""
    return (f"<rect x='{x:.1f}' y='{y:.1f}' width='{width:.1f}' height='{height:.1f}' fill='{look.colour}' "
            f"opacity='{0.45 if look.is_pale else 1}'/>")


def draw_legend(place: Place, title: str, looks: List[Look]) -> List[str]:
    """A panel's title, and the names of its bars in a line below."""
    parts, x = [text(place.left, place.top - 32, title, "font-weight='bold'")], place.left
    for look in looks:
        parts.append(rectangle(x, place.top - 23, 11, 11, look))
        parts.append(text(x + 16, place.top - 13, look.name, "font-size='12' fill='#333'"))
        x += 34 + 6.4 * len(look.name)
    return parts


def draw_bars(place: Place, title: str, looks: List[Look], groups: List[Group]) -> List[str]:
    """Bars from the line of path tracing up where a method gains, and down where it loses; the gain is at their ends."""
    values = [g for group in groups for g in group.gains]
    ends = (0.7 * min([0.9, *values]), 1.5 * max([1.1, *values]))
    ticks = [t for t in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if ends[0] <= t <= ends[1]]
    plot = Plot(*place, (0, 1), ends, (), ticks, "", "")
    plot.parts += draw_legend(place, title, looks)
    width, base = place.width / len(groups), plot.y(1)
    for i, group in enumerate(groups):
        bar, middle = min(34.0, 0.84 * width / len(looks)), place.left + (i + 0.5) * width
        for k, (value, look) in enumerate(zip(group.gains, looks)):
            x, end = middle + (k - len(looks) / 2) * bar, plot.y(value)
            plot.parts.append(rectangle(x + 1, min(base, end), bar - 2, max(abs(base - end), 0.5), look))
            plot.parts.append(text(x + bar / 2, end - 4 if value >= 1 else end + 12, three(value),
                                   "text-anchor='middle' font-size='10' fill='#333'"))
        for k, words in enumerate(group.lines):
            size = "font-size='12'" if k == 0 else "font-size='11' fill='#555'"
            plot.parts.append(text(middle, place.top + place.height + 16 + 14 * k, words, f"text-anchor='middle' {size}"))
    plot.parts.append(line(place.left, base, place.left + place.width, base, "stroke='#333'"))
    return plot.parts


def gain(errors: Errors, method: str, measure: str = MEASURE) -> float:
    """Path tracing's error over the method's."""
    return errors["pt"][measure] / errors[method][measure]


def equal_time(errors: Errors, method: str, measure: str = MEASURE) -> float:
    """The gain where both take as long: errors fall with the inverse of time."""
    return gain(errors, method, measure) * errors["pt"]["seconds"] / errors[method]["seconds"]


def budget_of(scene: Scene) -> str:
    """The last budget, such as "64 samples"."""
    return scene["summary"][-1]["budget"]


def openpgl_group(scene: Scene) -> Group:
    """wfpg and Open PGL at equal samples and at equal time."""
    errors = errors_at(scene, budget_of(scene))
    return Group([short(scene)], [of(errors, method) for method in ("wfpg", "vmm-1000") for of in (gain, equal_time)])


def last_group(scene: Scene, methods: Iterable[str], *more: str) -> Group:
    """Gains at the last budget, below them the scene's name and more lines."""
    errors = errors_at({"summary": scene["summary"]}, budget_of(scene))
    return Group([short(scene), *more], [gain(errors, method) for method in methods])


def draw_gains(folder: pathlib.Path) -> str:
    """Bars of gains: Open PGL, guides without next-event estimation, records, and the paper's own method."""
    found = scenes_of(folder, "quality-openpgl.json")
    looks = [Look("wfpg, equal samples", BLUE), Look("wfpg, equal time", BLUE, True), Look("Open PGL, equal samples", ORANGE),
             Look("Open PGL, equal time", ORANGE, True)]
    parts = draw_bars(Place(46, 58, 800, 170), f"Beside Open PGL: {budget_of(found[0])}, with next-event estimation", looks,
                      [openpgl_group(s) for s in found])

    found = scenes_of(folder, "quality-sarsa.json", "quality-sarsa-more.json")
    by_method = {"wfpg": Look("wfpg", BLUE), "sarsa-hemisphere": Look("SARSA", ORANGE),
                 "monte-carlo-hemisphere": Look("Monte Carlo", GOLD), "records": Look("irradiance records", GREEN)}
    parts += draw_bars(Place(46, 316, 800, 150),
                       f"Beside other guides: {budget_of(found[0])} on a GPU, without next-event estimation",
                       list(by_method.values()), [last_group(s, by_method) for s in found])

    found = sorted(scenes_of(folder, "quality-records.json"), key=lambda s: short(s) != "cornell-wall")
    by_method = {"wfpg": Look("wfpg", BLUE), "sarsa": Look("SARSA", ORANGE), "records": Look("irradiance records", GREEN)}
    parts += draw_bars(Place(46, 556, 480, 150), f"Beside records: {budget_of(found[0])}; next-event estimation on or off",
                       list(by_method.values()), [last_group(s, by_method, "on" if s["nee"] else "off") for s in found])

    found = scenes_of(folder, "quality-paper-veach-ajar.json", "quality-paper-bathroom.json")
    by_method = {"wfpg": Look("wfpg", BLUE), "wfpg-product": Look("product", BLUE, True), "paper": Look("paper", PURPLE),
                 "paper-product": Look("product", PURPLE, True)}
    parts += draw_bars(Place(586, 556, 260, 150), "Beside the paper's method", list(by_method.values()),
                       [last_group(s, by_method, budget_of(s)) for s in found])
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
    x_ticks = [int(t) if t >= 1 else t for t in ticks_between(xs)]
    plot = Plot(left, top, 212, 130, xs, ys, x_ticks, ticks_between(ys), short(scene), "", True)
    plot.parts += [line(plot.x(x), top, plot.x(x), top + 130, "stroke='#e4e4e4'") for x in x_ticks]
    plot.parts += [line(left, top + 130, left + 212, top + 130, "stroke='#999'"), line(left, top, left, top + 130, "stroke='#999'")]
    for method, curve in curves.items():
        plot.curve(curve, methods[method][1])
        plot.dots(curve, methods[method][1], radius=2.4)
    return plot.parts


def draw_error_over_time(folder: pathlib.Path) -> str:
    """Errors over seconds: the built-in scenes, and those of the literature beside Open PGL."""
    series = (("builtin-scenes.json", "Built-in scenes",
               {"pt": ("path tracing", GREY), "wfpg-transient-oriented": ("wfpg, transient", GOLD), "wfpg": ("wfpg", BLUE),
                "wfpg-product": ("wfpg-product", GREEN)}),
              ("quality-openpgl.json", "Scenes of the literature",
               {"pt": ("path tracing", GREY), "vmm-1000": ("Open PGL", ORANGE), "wfpg": ("wfpg", BLUE)}))
    parts: List[str] = []
    for block, (name, title, methods) in enumerate(series):
        scenes, top = scenes_of(folder, name), 60 + 408 * block
        threads = json.loads((folder / name).read_text(encoding="utf-8"))["machine"]["threads"]
        parts.append(text(14, top - 38, f"{title}: {threads} threads, to {budget_of(scenes[0])}", "font-weight='bold' fill='#555'"))
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

def linear_plot(left: float, top: float, curves: Dict[str, Points], title: str, along: str, names_below: bool) -> Plot:
    """A plot of errors over sample numbers, with room for names of curves below or above them."""
    values = [y for curve in curves.values() for _, y in curve]
    low, high = min(values), max(values)
    low, high = (low - 0.22 * (high - low), high) if names_below else (low, high + 0.35 * (high - low))
    step = 0.05 if high - low < 0.4 else 0.1
    ticks = [round(step * i, 2) for i in range(math.ceil(low / step), math.floor(high / step) + 1)]
    last = int(max(x for curve in curves.values() for x, _ in curve))
    return Plot(left, top, 350, 190, (1, last), (low, high), (1, 2, 4, 8, 16, 32, 64), ticks, title, along, True, False)


def over_plain_mean(scene: Scene, way: str) -> Points:
    """Error of combined samples of kept fields over that of their plain mean, by their number."""
    combined, noise = scene["single_samples"]["wfpg"]["combined"], scene["reference"]["noise"][MEASURE]
    errors = zip(combined[way][MEASURE], combined["constant"][MEASURE])
    return [(i, (e - noise) / (plain - noise)) for i, (e, plain) in enumerate(errors, 1) if e is not None]


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
        curves = {m: [(i + 1, (e - noise) / mean) for i, e in enumerate(found[m]["alone"][MEASURE])] for m in alone}
        one = linear_plot(58, top, curves, f"{short(scene)}: each sample alone", "sample", True)
        for method, (_, colour) in alone.items():
            one.curve(curves[method], colour)
        for k, (name, colour) in enumerate(alone.values()):
            one.label(one.left + 70 + 130 * (k % 2), one.top + one.height - 24 + 15 * (k // 2), name, colour)
        curves = {way: over_plain_mean(scene, way) for way in ways}
        other = linear_plot(476, top, curves, f"{short(scene)}: samples of kept fields combined", "samples", False)
        for way, colour in ways.items():
            other.curve(curves[way], colour)
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
