"""Tables and figures of docs/quality.md: gains, and what they cost."""
import re
from typing import Any, Dict, List

from blocks import Results, Rows, block, span, three

from quality_plots import Errors, budget_of, equal_time, gain, over_plain_mean, short  # bench/quality_plots.py
from table import errors_at  # bench/table.py


def pair(errors: Errors, method: str) -> str:
    """Gain in MSE, and in relative MSE."""
    return f"{three(gain(errors, method))} ({three(gain(errors, method, 'relmse_robust'))})"


def triple(errors: Errors, method: str) -> str:
    """Gain in MSE; in relative MSE, and at equal time."""
    return pair(errors, method)[:-1] + f"; {three(equal_time(errors, method))})"


def last_errors(scene: Dict[str, Any]) -> Errors:
    """A scene's errors at the last budget."""
    return errors_at(scene, budget_of(scene))


def summary(scene: Dict[str, Any], method: str) -> Dict[str, Any]:
    """What a method took and made at a scene's last budget."""
    return next(m for m in scene["summary"][-1]["methods"] if m["method"] == method)


@block
def builtin(results: Results) -> Rows:
    """Gains in the built-in scenes at equal samples and equal time."""
    rows = [["scene", "next-event estimation", "wfpg", "wfpg, equal time", "wfpg-product", "wfpg-product, equal time",
             "transient"]]
    for scene in results.json("builtin-scenes.json", "scenes"):
        e = errors_at(scene, "64 samples")
        cells = []
        for method in ("wfpg", "wfpg-product"):
            at_time = (three(equal_time(e, method, m)) for m in ("mse_reinhard", "relmse_robust"))
            cells += [pair(e, method), "{} ({})".format(*at_time)]
        name = {"thin-wall": "thin-wall, depth 6", "cornell-box": "cornell-box (nothing is hidden)"}.get(short(scene), short(scene))
        rows.append([name, "on" if scene["nee"] else "off", *cells, pair(e, "wfpg-transient-oriented")])
    return rows


@block
def openpgl(results: Results) -> Rows:
    """Gains of wfpg and of Open PGL's mixtures, and the memory that both keep after 256 samples."""
    scenes = results.json("quality-openpgl.json", "scenes")
    rows = [["gain", *map(short, scenes)]]
    names = {"wfpg": "wfpg", "vmm-1000": "Open PGL, vmm"}
    for samples in ("256 samples", "64 samples"):
        for method, name in names.items():
            rows.append([f"{samples}: {name}", *(triple(errors_at(s, samples), method) for s in scenes)])
    for method, name in names.items():
        rows.append([f"MiB kept: {name}", *(f"{summary(s, method)['persistent_bytes'] / 2**20:.1f}" for s in scenes)])
    return rows


@block
def openpgl_short_memory(results: Results) -> str:
    """Least and most MiB that Open PGL keeps after 64 samples."""
    kept = [summary(s, m["method"])["persistent_bytes"] / 2**20 for s in results.json("quality-openpgl-sweep.json", "scenes")
            for m in s["summary"][-1]["methods"] if m["method"] == "vmm-1000"]
    return span(kept, 0) + " MiB"


@block
def paper(results: Results) -> Rows:
    """The paper's method and ours, at the paper's size. Gains of the paper are read from its figure 8."""
    of_paper = {"paper": ("1.29", "1.10"), "paper-product": ("2.47", "1.36")}
    names = {"pt": "path tracing", "paper": "the paper's, plain (`paper`)", "paper-product": "the paper's, product (`paper-product`)",
             "wfpg-transient-oriented": "transient, oriented", "wfpg": "kept, oriented (the default)",
             "wfpg-product": "kept, oriented, product"}
    errors = [last_errors(results.json(f"quality-paper-{s}.json", "scenes", 0)) for s in ("veach-ajar", "bathroom")]
    rows = [["gain at equal samples (seconds)", "veach-ajar, 96 samples", "the paper's", "bathroom, 256 samples", "the paper's"]]
    for method, name in names.items():
        cells = [f"{three(gain(e, method))} ({three(e[method]['seconds'])})" for e in errors]
        rows.append([name, cells[0], of_paper.get(method, ("", ""))[0], cells[1], of_paper.get(method, ("", ""))[1]])
    return rows


@block
def lights(results: Results) -> Rows:
    """What the choice among lights gains."""
    scenes = results.json("quality-lights.json", "scenes")
    rows = [["256 samples, H200", *map(short, scenes)]]
    for method, name in {"wfpg": "wfpg", "by-power": "wfpg, one group of lights"}.items():
        rows.append([name, *(triple(errors_at(s, "256 samples"), method) for s in scenes)])
    return rows


@block
def guides(results: Results) -> Rows:
    """Gains of guides after one second without next-event estimation."""
    scenes = [s for f in ("quality-sarsa.json", "quality-sarsa-more.json") for s in results.json(f, "scenes")]
    rows = [["guide", *map(short, scenes)]]
    names = {"sarsa-hemisphere": "SARSA, hemisphere", "monte-carlo-hemisphere": "Monte Carlo, hemisphere",
             "records": "irradiance records", "wfpg": "octree guide"}
    for method, name in names.items():
        rows.append([name, *(pair(last_errors(s), method) for s in scenes)])
    return rows


@block
def records(results: Results) -> Rows:
    """Gains of irradiance records after 30 samples."""
    scenes = sorted(results.json("quality-records.json", "scenes"), key=lambda s: short(s) != "cornell-wall")
    rows = [["30 samples, H200", *(short(s) if "--nee off" not in s["scene"] else "without next-event estimation" for s in scenes)]]
    for method, name in {"records": "irradiance records", "sarsa": "SARSA grid", "wfpg": "octree guide"}.items():
        rows.append([name, *(three(gain(last_errors(s), method)) for s in scenes)])
    return rows


@block
def records_time(results: Results, scene: str) -> str:
    """Time of a sample with irradiance records over path tracing's."""
    return three(results.json("records-times-depths.json", "scenes", scene, "all", "median_time_over_pt"))


@block
def records_memory(results: Results) -> str:
    """Most MiB that irradiance records keep."""
    most = max(summary(s, "records")["persistent_bytes"] for s in results.json("quality-records.json", "scenes"))
    return f"{most / 2**20:.1f} MiB"


@block
def worst_tile(results: Results, who: str) -> str:
    """The largest difference of a tile's mean from path tracing's, in standard errors: of guides, or of path tracing."""
    file = {"guides": "quality-tiles.json", "pt": "quality-tiles-pt.json"}[who]
    return f"{max(abs(m['tiles']['worst']) for m in tiles(results, file)):.1f}"


@block
def number_of_tiles(results: Results, who: str) -> str:
    """How many tiles were compared."""
    file = {"guides": "quality-tiles.json", "pt": "quality-tiles-pt.json"}[who]
    return f"{sum(m['tiles']['count'] for m in tiles(results, file)):,}"


def tiles(results: Results, file: str) -> List[Dict[str, Any]]:
    """Summaries of methods whose tiles were compared; of path tracing's file, path tracing with seeds of its own."""
    is_guide = re.compile("pt-cuda" if "pt" in file else "wfpg")
    return [m for s in results.json(file, "scenes") for m in s["summary"][-1]["methods"] if is_guide.match(m["method"])]


@block
def without_groups(results: Results, scene: str) -> str:
    """The gain of wfpg without a choice among lights."""
    return three(next(gain(errors_at(s, "256 samples"), "by-power") for s in results.json("quality-lights.json", "scenes")
                      if short(s) == scene))


@block
def combining(results: Results, way: str) -> str:
    """The error of combined samples of kept fields over that of their plain mean, after the last one."""
    return f"{over_plain_mean(results.json('quality-series.json', 'scenes', 0), way)[-1][1]:.2f}"


def rested(cell: Dict[str, Any]) -> str:
    """Gain at equal samples, and in brackets at equal time."""
    return f"{three(cell['gain'])} ({three(cell['equal_time'])})"


@block
def gains(results: Results) -> Rows:
    """The README's table: gains on one thread."""
    of = {"cornell-enclosed": "off", "ajar": "on", "thin-wall": "on", "glossy-room": "off", "cornell-box": "on"}
    rows = [["scene", "next-event estimation", "equal samples", "equal time"]]
    for scene, nee in of.items():
        cell = results.json("rest.json", "cpu", "scenes", scene, "64")
        name = scene + {"cornell-box": " (nothing is hidden)", "thin-wall": ", depth 6"}.get(scene, "")
        rows.append([name, nee, three(cell["gain"]), three(cell["equal_time"])])
    return rows


@block
def rests(results: Results) -> Rows:
    """Gains of guides that may rest, on CPU and GPU, and how many samples rested in each seed."""
    order = ("ajar", "thin-wall", "glossy-room", "cornell-enclosed", "cornell-wall", "veach-ajar.glb", "bathroom.glb", "staircase2.glb",
             "cornell-box.glb", "cornell-box", "veach-mis.glb", "materials", "outdoor", "furnace")
    cpu, gpu = (results.json("rest.json", device, "scenes") for device in ("cpu", "gpu"))
    rows = [["scene", "CPU, 16 samples", "CPU, 64", "GPU, 16", "GPU, 64", "CPU, of 64 samples rest"]]
    for scene in order:
        cells = [rested(on[scene][n]) if scene in on else "—" for on in (cpu, gpu) for n in ("16", "64")]
        numbers = cpu[scene]["64"]["rested"]
        name = scene if scene == "cornell-box.glb" else scene.replace(".glb", "")
        rows.append([name, *cells, ", ".join(map(str, numbers)) if any(numbers) else "0"])
    return rows
