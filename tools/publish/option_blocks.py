"""Tables and figures of docs/ablations.md and docs/tuning.md: what parts and options of the guide do."""
from typing import Any, Dict, List

from blocks import Results, Rows, block, per_cent, three

ROOM, MORE, AIMED = "room.json", "room-64.json", "aimed-cones.json"
FRACTIONS, TUNING, CEILING = "fractions.json", "tuning.json", "ceiling.json"
UNAIMED, MORE_UNAIMED = "room-unaimed.json", "room-64-unaimed.json"
DESIGNS = {
    "cosine": "cosine alone", "wfpg": "wfpg's fields", "unaimed": "wfpg's fields, without aimed cones",
    "openpgl-pavmm": "Open PGL 0.7.1, parallax-aware mixtures",
    "openpgl-quadtree": "Open PGL 0.7.1, quadtrees", "recorded-grid-mean": "paths: grid", "recorded-quadtree-mean": "paths: quadtree",
    "recorded-caps-mean": "paths: caps", "cache-grid-mean": "cache: grid", "cache-grid-rms": "cache: grid, roots",
    "exact-grid-mean": "exact: grid", "exact-grid-rms": "exact: grid, roots", "exact-blocks-mean": "exact: blocks",
    "exact-caps-mean": "exact: caps", "exact-quadtree-mean": "exact: quadtree", "exact-quadtree-rms": "exact: quadtree, roots"}


def variance(found: Dict[str, float]) -> str:
    """Relative variance, mean and median over places."""
    return " / ".join(f"{found[key]:#.3g}".rstrip(".") for key in ("mean", "median"))


@block
def room(results: Results) -> Rows:
    """Variance of designs in a room of known light."""
    methods = dict(results.json(ROOM, "methods"), unaimed=results.json(UNAIMED, "methods", "wfpg"))
    rows = [["design", "half and half with a cosine", "alone"]]
    for method, name in DESIGNS.items():
        rows.append([name, variance(methods[method]["half"]), variance(methods[method]["alone"])])
    return rows


@block
def room_aimed(results: Results) -> str:
    """Mean variance of fields with aimed cones over that without, half and half."""
    before, after = (results.json(file, "methods", "wfpg", "half", "mean") for file in (UNAIMED, ROOM))
    return f"{after / before:.2f}"


@block
def room_more_unaimed(results: Results) -> str:
    """Variance of fields without aimed cones after four times the samples, half and half."""
    return variance(results.json(MORE_UNAIMED, "methods", "wfpg", "half"))


@block
def aimed_cones(results: Results) -> Rows:
    """Variance in the room by what an aimed cone does."""
    rows = [["what an aimed cone does", "half and half"]]
    return rows + [[name, variance(found)] for name, found in results.json(AIMED, "room").items()]


@block
def aimed_pictures(results: Results, scene: str, spp: str, seeds: str) -> str:
    """Variance of pictures with aimed cones over that without."""
    rows = [row for row in results.json(AIMED, "pictures", "mse_reinhard")
            if (row["scene"], row["spp"], row["seeds"]) == (scene, int(spp), int(seeds))]
    if len(rows) != 1:
        raise KeyError(f"{AIMED} has {len(rows)} pictures of {scene}")
    return f"{rows[0]['aimed'] / rows[0]['before']:.3f} times"


@block
def room_more(results: Results, method: str) -> str:
    """Variance half and half after four times the samples."""
    return variance(results.json(MORE, "methods", method, "half"))


@block
def room_ratio(results: Results, first: str, second: str) -> str:
    """Mean variance of one design over that of another, half and half."""
    before, after = (results.json(ROOM, "methods", m, "half", "mean") for m in (first, second))
    return f"{before / after:.2g}"


@block
def fractions(results: Results, samples: str) -> Rows:
    """Gains with constant and learnt fractions; in brackets at equal time."""
    names = ("0.5", "0.7", "0.9", "learnt")
    rows = [[f"{samples} samples", *names]]
    for scene, found in results.json(FRACTIONS, "scenes").items():
        rows.append([scene, *(f"{three(found[samples][n]['gain'])} ({three(found[samples][n]['equal_time'])})" for n in names)])
    return rows


def learnt_over(results: Results, key: str, scenes: List[str]) -> List[float]:
    """A value with learnt fractions over that with the constant 0.7, of each scene and number of samples."""
    found = results.json(FRACTIONS, "scenes")
    return [found[s][n]["learnt"][key] / found[s][n]["0.7"][key] for s in scenes or found for n in ("16", "64")]


@block
def fractions_gain(results: Results, *scenes: str) -> str:
    """What learnt fractions gain in these scenes, least and most."""
    ratios = learnt_over(results, "gain", list(scenes))
    return per_cent([ratio - 1 for ratio in ratios])


@block
def fractions_gain_at(results: Results, scene: str, samples: str) -> str:
    """What learnt fractions gain in a scene."""
    found = results.json(FRACTIONS, "scenes", scene, samples)
    return f"{100 * (found['learnt']['gain'] / found['0.7']['gain'] - 1):.0f}%"


@block
def fractions_time(results: Results, which: str) -> str:
    """Time of learnt fractions beyond a constant one's: `median` or `most`."""
    ratios = sorted(learnt_over(results, "seconds", []))
    middle = len(ratios) // 2
    value = ratios[-1] if which == "most" else (ratios[middle - 1] + ratios[middle]) / 2
    return f"{100 * (value - 1):.0f}%"


GUIDES = {"cold": "begins with nothing", "default": "trained", "finer": "48² cells", "larger": "1 GiB", "both": "both"}


def possible(found: Dict[str, Any]) -> float:
    """Gain of a guide that begins with nothing, over that of the best trained one."""
    return found["gain"]["cold"] / max(found["gain"].values())


@block
def ceiling(results: Results) -> Rows:
    """Gains of guides that begin with nothing and that were trained for long, and MiB of the best one's fields."""
    rows = [["scene", *GUIDES.values(), "of the possible", "MiB of both"]]
    for scene, found in results.json(CEILING, "scenes").items():
        rows.append([scene, *(three(found["gain"][g]) for g in GUIDES), f"{100 * possible(found):.0f}%",
                     f"{found['bytes']['both'] / 2**20:.0f}"])
    return rows


@block
def ceiling_parts(results: Results) -> str:
    """Part of the possible gain that a guide has which begins with nothing, least and most."""
    return per_cent([possible(found) for found in results.json(CEILING, "scenes").values()])


@block
def ceiling_learning(results: Results) -> str:
    """Part of the default guide's gain that is missing where it begins with nothing, least and most."""
    parts = [1 - found["gain"]["cold"] / found["gain"]["default"] for found in results.json(CEILING, "scenes").values()]
    return per_cent(parts)


@block
def ceiling_finer(results: Results, scene: str) -> str:
    """Gain of a trained guide with finer cells in equal memory, over that with the default's."""
    gain = results.json(CEILING, "scenes", scene, "gain")
    return f"{gain['finer'] / gain['default']:.2f}"


def option(results: Results, name: str, value: Any) -> List[str]:
    """Gains with a value of an option, in cornell-enclosed and ajar, and cones for each path segment."""
    line = next(v for v in results.json(TUNING, "options", name) if v["value"] == value)
    scenes = [line["scenes"][s] for s in ("cornell-enclosed --nee off", "ajar")]
    cones = ", ".join(f"{s['cones_per_segment']:.1f}" for s in scenes)
    has_cones = name in ("rays_per_bin", "kept.recast")
    return [*(f"{s['gain']:.1f}" for s in scenes), cones if has_cones else ""]


@block
def tuning(results: Results) -> Rows:
    """Gains with single options at other values."""
    rows = [["option", "value", "gain, cornell-enclosed", "gain, ajar", "cones a segment"]]
    default = option(results, "kept.recast", 32)
    rows.append(["all defaults", "", *default])
    names = {"octree_resolution": "`octree_resolution`", "rays_per_bin": "`rays_per_bin`", "guide_fraction": "`guide_fraction`",
             "product_resolution": "`product_resolution`", "kept.budget_bytes, MiB": "`kept.budget_bytes`, MiB",
             "kept.resolution": "`kept.resolution`", "kept.recast": "`kept.recast`",
             "deposits_per_leaf, octree 32": "`deposits_per_leaf`, with an octree of 32"}
    for key, name in names.items():
        values = [v["value"] for v in results.json(TUNING, "options", key) if not v["is_default"] or "octree 32" in key]
        for value in values:
            rows.append([name if value == values[0] else "", str(value), *option(results, key, value)])
    rows.append(["`kept.learn`", "false", *option(results, "kept.learn", "off")])
    rows.append(["", "false, with `kept.recast` 8", *option(results, "kept.recast, learn off", 8)])
    return rows


@block
def tuning_noise(results: Results, scene: str) -> str:
    """Noise of a scene's reference."""
    return f"{next(v for k, v in results.json(TUNING, 'references').items() if k.split()[0] == scene):.1e}".replace("e-0", "e-")


@block
def guided_depths(results: Results) -> Rows:
    """Gains where fewer depths are guided."""
    last, few = ({s["scene"].split(".")[0]: {m["method"]: m["errors"]["mse_reinhard"] for m in s["summary"][0]["methods"]}
                  for s in results.json(f, "scenes")} for f in ("quality-last-depth.json", "quality-guided-depths.json"))
    rows = [["gain", "veach-ajar", "bathroom", "staircase2"]]
    lines = {"all depths but the last": (last, "wfpg"), "all depths but two": (last, "depths-5"),
             "three depths": (few, "depths-3"), "two depths": (few, "depths-2"), "one depth": (few, "depths-1")}
    for name, (found, method) in lines.items():
        cells = [found[s][method] if s in found else None for s in rows[0][1:]]
        rows.append([name, *(f"{c['ratio']:.2f} ± {c['ratio_standard_error']:.2f}" if c else "" for c in cells)])
    return rows


@block
def orientation(results: Results, mode: str) -> str:
    """Gains of transient fields in cornell-enclosed and ajar, `oriented` or `plain`."""
    found = results.json("products.json", "equal_samples")
    ending = ", plain" if mode == "plain" else ""
    gains = [found[f"{scene}: wfpg, transient{ending}"]["ratio_to_pt"][0] for scene in ("cornell-enclosed", "ajar")]
    return f"{gains[0]:.1f} and {gains[1]:.1f}"
