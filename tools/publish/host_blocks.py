"""Tables and figures of docs/algorithm.md, docs/guides.md, docs/host.md and docs/hosts.md."""
from typing import Any, Dict, List

from blocks import Results, Rows, block, per_cent, three
from quality_blocks import short, summary

CONES, SOURCES, REST = "quality-cones.json", "octree-sources.json", "rest.json"


@block
def cones(results: Results) -> Rows:
    """Gains of three ways for a cone to find light, and in brackets their time over path tracing's."""
    names = {"kept-scene": ("kept", "`scene`"), "kept-march": ("kept", "`march`"), "kept-trace": ("kept", "`trace`"),
             "kept-trace-all": ("kept, `recast` 1", "`trace`"), "transient-scene": ("transient", "`scene`"),
             "transient-march": ("transient", "`march`"), "transient-trace": ("transient", "`trace`")}
    scenes = results.json(CONES, "scenes")
    rows = [["fields", "cones", *map(short, scenes)]]
    for method, name in names.items():
        cells = []
        for scene in scenes:
            m, pt = summary(scene, method), summary(scene, "pt")
            cells.append(f"{three(m['errors']['mse_reinhard']['ratio'])} ({m['seconds']['mean'] / pt['seconds']['mean']:.1f})")
        rows.append([*name, *cells])
    return rows


def relative_errors(results: Results, file: str) -> List[float]:
    """Standard errors of gains over the gains, path tracing's left out."""
    found = [m["errors"]["mse_reinhard"] for s in results.json(file, "scenes") for m in s["summary"][0]["methods"]
             if m["method"] != "pt"]
    return [e["ratio_standard_error"] / e["ratio"] for e in found]


@block
def cones_errors(results: Results) -> str:
    """Standard errors of the gains of cones."""
    return per_cent(relative_errors(results, CONES))


@block
def cones_all(results: Results) -> str:
    """What casting all cones in each refresh gains."""
    scenes = results.json(CONES, "scenes")
    gain = [[summary(s, m)["errors"]["mse_reinhard"]["ratio"] for m in ("kept-trace-all", "kept-trace")] for s in scenes]
    return per_cent([a / b - 1 for a, b in gain])


@block
def sources(results: Results) -> Rows:
    """Gains of octrees of triangles, of the caster's hits and of the first sample's."""
    rows = [["scene", "triangles", "caster", "first sample", "first sample / triangles"]]
    for scene in results.json(SOURCES, "scenes"):
        gains = [summary(scene, m)["errors"]["mse_reinhard"]["ratio"] for m in ("triangles", "caster", "samples")]
        rows.append([short(scene), *map(three, gains), three(gains[2] / gains[0])])
    return rows


@block
def sources_alike(results: Results) -> str:
    """Gains of first samples' octrees over those of triangles'."""
    scenes = results.json(SOURCES, "scenes")
    gain = [[summary(s, m)["errors"]["mse_reinhard"]["ratio"] for m in ("samples", "triangles")] for s in scenes]
    return per_cent([a / b for a, b in gain])


@block
def sources_errors(results: Results) -> str:
    """Standard errors of those gains."""
    return per_cent(relative_errors(results, SOURCES))


@block
def kernels_gain(results: Results, scene: str) -> str:
    """The gain of luminance in the example with kernels of its own."""
    return results.found("kernels-gains.txt", rf"^{scene} +[\d.]+ +([\d.]+)$")[1]


@block
def sarsa_bias(results: Results) -> Rows:
    """What SARSA grids know of a furnace."""
    rows = [line.strip("| ").split(" | ") for line in results.text("sarsa-bias.txt").split("\n") if line.startswith("|")]
    chosen = [[row[i] for i in (0, 1, 2, 3, 5, 7, 8)] for row in rows]
    return [["update", "`learning_rate`", "`step`", "8 samples", "32", "128", "256"], *chosen[1:]]


def at_equal_time(results: Results, device: str, *samples: str) -> Dict[str, List[float]]:
    """Gains at equal time of each scene on `cpu` or `gpu`."""
    found: Dict[str, Any] = results.json(REST, device, "scenes")
    return {scene: [of[n]["equal_time"] for n in samples] for scene, of in found.items()}


@block
def rests_gpu(results: Results) -> str:
    """How many scenes gain on a GPU, and how much at least and at most."""
    found = at_equal_time(results, "gpu", "16", "64")
    gains = [g for g in found.values() if min(g) > 1.1]
    return (f"{len(gains)} of {len(found)} scenes gain {min(map(min, gains)):.1f} to {max(map(max, gains)):.0f} times at equal "
            "time")


@block
def rests_gpu_loss(results: Results) -> str:
    """The most that a scene loses on a GPU."""
    return f"{100 * (1 - min(map(min, at_equal_time(results, 'gpu', '16', '64').values()))):.0f}%"


def with_interval(of: List[float]) -> str:
    """A median and the ends of its interval."""
    return f"{of[0]:.2f} ({of[1]:.2f} to {of[2]:.2f})"


@block
def pairs(results: Results, samples: str) -> Rows:
    """Times of guided renderings over path tracing's, and gains at equal time, one after the other on a core."""
    rows = [["scene", "time", "equal time", "products: time", "products: equal time", "samples that rest"]]
    for scene, cell in results.json("pairs.json", samples, "scenes").items():
        found = [with_interval(cell[method][what]) for method in ("wfpg", "wfpg-product") for what in ("time", "equal_time")]
        rows.append([scene.replace(".glb", ""), *found, f"{cell['wfpg']['rested']:.0f}"])
    return rows


@block
def pairs_gains(results: Results) -> Rows:
    """What guides gain on single threads where light is hard to find; beside it over an older path tracer's time."""
    rows = [["scene", "gain", "time", "equal time", "over the older path tracing", "its time"]]
    for scene, cell in results.json("pairs-hard.json", "64", "scenes").items():
        of = cell["wfpg"]
        found = [with_interval(x) for x in (of["time"], of["equal_time"], of["equal_time_older"], cell["older"]["time"])]
        rows.append([scene.replace(".glb", ""), three(of["gain"]), *found])
    return rows
