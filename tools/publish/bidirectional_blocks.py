"""Tables and figures of docs/bidirectional.md: gains, times, and comparisons with other programs."""
import math
import re
from typing import Dict, List, NamedTuple, Tuple

from blocks import Results, Rows, block, span, three
from programs import is_hidden  # bench/programs.py

GPU, TECHNIQUES, VCM, UPBP = "bidirectional-gpu.txt", "techniques.txt", "smallvcm.txt", "smallupbp.txt"
STAGES, TIMES, ENDS = "cuda-stages.json", "cuda-light-times.json", "cuda-both-ends.json"
LARGE = "cuda-both-ends-large.json"


def two(value: float) -> str:
    """A number with two digits that matter: 0.71, 1.6, 24."""
    return f"{value:#.2g}".rstrip(".")


def section(results: Results, begin: str, end: str = "\n\n") -> List[str]:
    """Lines of a text file of the GPU from one that begins so, up to the first of `end` after it."""
    text = results.text(GPU)
    at = text.index("\n" + begin) + 1
    return text[at:text.index(end, at)].split("\n")


def cell(lines: List[str], name: str, row: int) -> float:
    """A number of a table with columns of fixed width: it begins where its name does in the head, or two letters off."""
    at = next(line for line in lines if name in line).index(name)
    found = [m for m in re.finditer(r"(?<= )\d[\d.]*", lines[row]) if abs(m.start() - at) <= 2]
    if len(found) != 1:
        raise ValueError(f"{GPU}: no {name} in {lines[row]}")
    return float(found[0][0])


def gains(results: Results, scene: str, kind: str = "mse_reinhard", file: str = ENDS, only: Tuple[str, ...] = ()) -> Dict[str, float]:
    """The error of path tracing over that of each method, or of some, at equal time. References must not hide it by their noise."""
    (measured,) = [s for s in results.json(file, "scenes") if s["scene"] == scene]
    found, noise = measured["methods"], measured["reference_noise"][kind]
    first = next(iter(found.values()))
    asked = {name: method for name, method in found.items() if name in (only or found)}
    if any(is_hidden(method[kind], noise) for method in (first, *asked.values())):
        raise ValueError(f"{file}: references of {scene} are too noisy")
    return {name: float(first[kind] / method[kind]) for name, method in asked.items()}


def gains_of(results: Results, scenes: Dict[str, str], named: Dict[str, str]) -> Rows:
    """A table of gains with the best of a row to take, of methods by their names in the head."""
    rows = [["scene", *named, "take"]]
    for scene, what in scenes.items():
        found = gains(results, scene)
        best = max(named, key=lambda name: found[named[name]])
        rows.append([f"`{scene}`, {what}", *(two(found[method]) for method in named.values()), best])
    return rows


@block
def both_ends(results: Results) -> Rows:
    """Gains at equal time."""
    scenes = {"caustic-pool": "water that focuses light", "mirror-balls": "a lamp in glass, seen in mirrors",
              "veach-bidir": "lamps in shades, a glass egg"}
    return gains_of(results, scenes, {"guided (wfpg)": "wfpg", "bpt": "bpt", "vcm": "vcm"})


@block
def both_ends_media(results: Results) -> Rows:
    """Gains in media at equal time."""
    scenes = {"fog-spot": "a slit in thin fog", "glass-caustic-fog": "a ball of glass in fog", "bottles": "liquids before a mirror",
              "wax": "dense candles"}
    return gains_of(results, scenes, {m: m for m in ("bpt", "vcm", "bpt+pp3d", "bpt+pb2d", "bpt+bb1d", "upbp")})


@block
def both_ends_setup(results: Results) -> str:
    """Seconds, size and GPU of these gains."""
    gpu = results.json(ENDS, "gpu_and_driver").split(",")[0]
    return f"{results.json(ENDS, 'seconds'):g} seconds of {results.json(ENDS, 'size')} on one {gpu}"


@block
def more_photons(results: Results) -> str:
    """The error of upbp with more beams and all photons, over that with the default numbers, at equal time."""
    found = [gains(results, scene["scene"]) for scene in results.json(ENDS, "scenes")]
    return span([g["upbp"] / g["upbp-more"] for g in found if "upbp-more" in g], 2)


@block
def dense_photons(results: Results) -> str:
    """The error of vcm with all photons over that with those kept where they are dense, at equal time."""
    found = [gains(results, scene["scene"]) for scene in results.json(ENDS, "scenes")]
    return span([g["vcm"] / g["vcm-all"] for g in found if "vcm-all" in g], 2)


@block
def dense_photons_large(results: Results) -> str:
    """Likewise of large pictures of veach-bidir. References of the other scenes hide the errors there."""
    found = gains(results, "veach-bidir", file=LARGE)
    return two(found["vcm"] / found["vcm-all"])


@block
def large_setup(results: Results) -> str:
    """Seconds and size of these pictures."""
    return f"{results.json(LARGE, 'seconds'):g} seconds of {results.json(LARGE, 'size')}"


@block
def bpt_in_wax(results: Results) -> str:
    """The gain of bpt in wax in relative MSE."""
    return two(gains(results, "wax", "relmse", only=("bpt",))["bpt"])


@block
def mirror_balls_mse(results: Results) -> str:
    """The gain of vcm in mirror-balls in MSE."""
    return two(gains(results, "mirror-balls", "mse", only=("vcm",))["vcm"])


@block
def ordered_photons(results: Results) -> str:
    """Time of a sample with photons in the order of their map over that without."""
    lines = section(results, "                           one     one a      ordered", "wax")
    ratios = [cell(lines, "ordered", r) / cell(lines, "one a  ", r) for r in (3, 5, 7)]
    return span(ratios, 2)


def stage_ratio(results: Results, name: str) -> float:
    """Time of a stage over its floor, by the begin of its name."""
    (found,) = [b["ratio"] for b in results.json(STAGES, "benchmarks") if b["name"].startswith(name + "/")]
    return float(found)


@block
def merging_ratio(results: Results, photons: str) -> str:
    """Time of merging over its floor, with `spread` or `clustered` photons."""
    clustered = {"spread": 0, "clustered": 1}[photons]
    return f"{stage_ratio(results, f'merging/thousands:2000/clustered:{clustered}'):.2g}"


@block
def iteration_ratio(results: Results) -> str:
    """Time of an iteration of bpt over its rays', in caustic-pool and mirror-balls."""
    first, second = (stage_ratio(results, f"iteration/mirror_balls:{scene}/merges:0") for scene in (0, 1))
    return f"{first:.1f} and {second:.1f} times"


SAMPLE_STAGES = {"light paths": ("light paths", "splats"), "maps": ("photon map",), "camera paths": ("camera", "trace", "shade"),
                 "connections": ("connections",), "merges": ("merges",), "all": ("total",)}


def stage_cells(milliseconds: Dict[str, float]) -> List[str]:
    """A sample's times, by groups of stages."""
    sums = [sum(milliseconds[part] for part in parts) for parts in SAMPLE_STAGES.values()]
    return [three(x) if x > 0 else "" for x in sums]


@block
def light_times(results: Results) -> Rows:
    """Milliseconds of a sample, by stage."""
    return [["scene", "method", *SAMPLE_STAGES],
            *([f"`{s['scene']}`", s["method"], *stage_cells(s["milliseconds"])] for s in results.json(TIMES, "samples"))]


@block
def upbp_times(results: Results) -> Rows:
    """Likewise of upbp in two scenes of the UPBP paper."""
    return [["scene", "pixels", *SAMPLE_STAGES],
            *([s["scene"], s["size"], *stage_cells(s["milliseconds"])] for s in results.json("cuda-upbp-times.json", "samples"))]


def registers(results: Results) -> List[str]:
    """The table of stages with and without a bound of registers."""
    return section(results, "                             sample  light paths  splats")


@block
def bounded(results: Results, stage: str) -> str:
    """Time of kernels with bounded registers over that without: `merges`, `trace` along segments, or `connections`."""
    pairs = {"merges": ((3, 4), (7, 8), (9, 10), (11, 12), (14, 15)), "trace": ((9, 10), (11, 12), (14, 15)),
             "connections": ((1, 2), (5, 6), (14, 16))}[stage]
    lines = registers(results)
    ratios = [cell(lines, stage, after) / cell(lines, stage, before) for before, after in pairs]
    return span(ratios, 2)


@block
def bounded_in_fog(results: Results) -> str:
    """The same of connections in fog-spot."""
    lines = registers(results)
    return f"{cell(lines, 'connections', 13) / cell(lines, 'connections', 11):.1f}"


class Technique(NamedTuple):
    """A technique alone: difference from the reference and its error in per cent, and a tile's median error."""
    difference: float
    error: float
    tile: str


def technique(results: Results, name: str) -> Technique:
    """A technique's row."""
    found = results.found(TECHNIQUES, rf"^  {name} +\d+ +([+-][\d.]+)%, z (-?[\d.]+) +([\d.]+%)")
    return Technique(float(found[1]), float(found[1]) / float(found[2]), found[3])


def white_box(results: Results) -> List[float]:
    """Differences of a white box's radiance from what it is, in per cent."""
    runs = re.findall(r"([12]\.\d{5}) \+-", results.text(TECHNIQUES))
    return [100 * abs(float(run) / 2 - 1) for run in runs]


@block
def techniques(results: Results) -> Rows:
    """What each technique finds alone."""
    box = [technique(results, n) for n in ("hits", "nee", "splat", "surf")]
    fog = [technique(results, n) for n in ("pb2d", "bb1d")]
    points = technique(results, "pp3d")
    sets = len(re.findall(r"^  \S+ +[12]\.\d{5} \+-", results.text(TECHNIQUES), re.MULTILINE))
    return [["", "scene", "difference, per cent", "a tile's error, median"],
            ["hits, nee, splat, surf", "`cornell-box`, from pt", span([t.difference for t in box], 2),
             span([float(t.tile[:-1]) for t in box], 2) + "%"],
            ["pb2d, bb1d", "`fog-lamp`, from bpt",
             f"{span([t.difference for t in fog], 1)}, within an error of {max(t.error for t in fog):.1f}", max(t.tile for t in fog)],
            ["pp3d", "`fog-lamp`, from bpt", f"{points.difference:.1f}, with an error of {points.error:.1f}", points.tile],
            [f"{sets} sets of techniques", "a white box full of white fog", f"at most {max(white_box(results)):.2f}", ""]]


@block
def white_box_runs(results: Results) -> str:
    """How many runs of the white box are right within 0.1%."""
    found = white_box(results)
    return f"{sum(d < 0.1 for d in found)} of {len(found) + 1} runs are within 0.1%"


@block
def vpt_below(results: Results) -> str:
    """How far vpt was below bpt in fog-lamp."""
    return f"{-technique(results, 'vpt').difference:.2f}%"


def differences(results: Results, file: str, row: str) -> Tuple[float, float]:
    """Difference of whole pictures and its standard error, in per cent: rows with other seeds together, by their errors."""
    text = results.text(file).split("\nmerges of radius")[0]
    found = re.findall(rf"^{row} .* ([+-]\d+\.\d+)  +(\d+\.\d+) +[+-]\d+\.\d+ ", text, re.MULTILINE)
    if not found:
        raise ValueError(f"{file} has no row {row}")
    weights = [1 / float(error)**2 for _, error in found]
    mean = sum(w * float(d) for w, (d, _) in zip(weights, found)) / sum(weights)
    return mean, 1 / math.sqrt(sum(weights))


def with_error(value: Tuple[float, float]) -> str:
    """A difference and its standard error; one decimal where the error is large."""
    digits = 2 if value[1] < 0.4 else 1
    return f"{value[0]:.{digits}f} ± {value[1]:.{digits}f}"


@block
def smallvcm(results: Results) -> Rows:
    """Differences from SmallVCM's pictures, diffuse floor."""
    scenes = ("0: a mirror and a glass sphere, sun", "1: a large mirror sphere, area light", "2: as 0, point light",
              "3: as 0, light from all directions")
    rows = [["SmallVCM's Cornell box, diffuse floor", "bpt", "vcm", "pt"]]
    for scene in scenes:
        methods = ("bpt  ", "vcm, anew" if scene[0] == "1" else "vcm  ", "pt  ")
        rows.append([scene, *(with_error(differences(results, VCM, rf"diffuse  {scene[0]}  {m}")) for m in methods)])
    return rows


def vcm_rows(results: Results) -> List[List[str]]:
    """The columns after the means of all comparisons with SmallVCM, without the planted one."""
    text = results.text(VCM)
    return [found.split() for found in re.findall(r"^(?:diffuse|metal|constant) .* \d\.\d{5} \d\.\d{5} +(.*)$",
                                                  text[:text.index("planted: ")], re.MULTILINE)]


@block
def smallvcm_tiles(results: Results) -> str:
    """How many tiles differ by less than 4 standard errors."""
    rows = vcm_rows(results)
    return f"{sum(int(r[5]) for r in rows)} of {sum(int(r[4]) for r in rows)} tiles"


@block
def smallvcm_median(results: Results) -> str:
    """Least and most of median tiles' errors."""
    errors = [float(e) for r in vcm_rows(results) for e in r[8:10]]
    return span(errors) + "%"


@block
def smallvcm_largest(results: Results) -> str:
    """The largest difference of whole pictures in standard errors, and what fresh seeds made of it."""
    most = max(vcm_rows(results), key=lambda r: abs(float(r[2])))
    anew = results.found(VCM, r"^metal    0  pt, anew .* ([+-]\d+\.\d+) +\d+\.\d+ +([+-]\d+\.\d+) ")
    return f"{abs(float(most[2])):.1f} standard errors, became {abs(float(anew[2])):.1f}"


@block
def smallvcm_planted(results: Results) -> str:
    """What a picture scaled by 1.01 is off, in standard errors."""
    return span([float(r[3]) for r in vcm_rows(results)], 0)


def in_errors(results: Results, row: str) -> str:
    """A difference from smallupbp's picture, in standard errors."""
    value = differences(results, UPBP, row)
    return f"{abs(value[0] / value[1]):.1f}"


@block
def smallupbp(results: Results) -> Rows:
    """Differences from smallupbp's pictures, in media."""
    scenes = {"0: a sphere that absorbs, area light": ("vptmis", "bpt", None),
              "40: a glass sphere with a dense medium, area light": ("vptmis", "bpt", "ALL +0.02 +512"),
              "14: fog, a large area light": ("upbp_bpt", "bpt", "ALL +0.02 +512"),
              "19: fog, a small area light": ("upbp_bpt", "bpt", "ALL"), "13: fog, a point light": (None, "bpt", "ALL"),
              "18: fog, a point light that the camera faces": (None, "bpt", None)}
    rows = [["smallupbp's scene", "vpt", "bpt", "upbp"]]
    for scene, methods in scenes.items():
        number = scene.split(":")[0]
        cells = [with_error(differences(results, UPBP, rf" *{number} +{m} ")) if m else "" for m in methods]
        if number == "0":  # with wider bounds of photons
            cells[2] = with_error(differences(results, UPBP, r"wider    bpt\+surf"))
        rows.append([scene, *cells])
    return rows


@block
def smallupbp_fog(results: Results) -> str:
    """The difference of upbp in scene 14, in standard errors."""
    return in_errors(results, r" 14 +ALL +0.02 +512 ")


@block
def upbp_scenes(results: Results) -> Rows:
    """Two scenes of the UPBP paper: differences from smallupbp, and wfpg's time over its."""
    rows = [["scene, path segments", "bpt", "upbp", "time"]]
    for scene, name in {"MB": "Mirror Balls, 12", "SL": "Still Life, 80"}.items():
        times = [float(t) for t in re.findall(rf"^{scene} +(?:400|800)x(?:400|350) .* ([\d.]+)$", results.text(UPBP), re.MULTILINE)]
        upbp = with_error(differences(results, UPBP, r"MB +upbp +26 x 8")) if scene == "MB" else ""
        rows.append([name, with_error(differences(results, UPBP, rf"{scene} +bpt")), upbp, span(times)])
    return rows


@block
def upbp_scenes_difference(results: Results) -> str:
    """The difference of upbp in Mirror Balls, in standard errors."""
    return in_errors(results, r"MB +upbp +26 x 8")


@block
def upbp_scenes_floor(results: Results) -> str:
    """How much brighter a part of Still Life's floor is."""
    found = results.found(UPBP, r"\+([\d.]+)%, and .*\+([\d.]+)%\.$")
    return span([float(found[1]), float(found[2])], 0) + "%"


@block
def upbp_scenes_whole(results: Results) -> str:
    """Time of one sample of all pixels of Mirror Balls over smallupbp's."""
    return f"{float(results.found(UPBP, r'^MB +800x800 .* ([0-9.]+)$')[1]):.1f}"
