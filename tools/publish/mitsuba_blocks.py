"""Tables and figures that compare the renderer with Mitsuba 3, in docs/performance.md."""
from typing import Any, Dict, List

from blocks import Results, Rows, block, span, three

TILES, TIMES = "mitsuba-tiles.json", "mitsuba-times.json"
METHODS = {"pt": "path tracing", "wfpg": "guided"}


def compared(results: Results) -> List[Dict[str, Any]]:
    """Comparisons of tiles with their method, its name, their scene and its HDR-FLIP."""
    return [{**m, "scene": s["scene"], "name": METHODS[name], "method": name, "flip": s["flip"]}
            for s in results.json(TILES, "scenes") for name, m in s["methods"].items()]


@block
def mitsuba_means(results: Results) -> Rows:
    """Means of the picture and of tiles beside Mitsuba's, and HDR-FLIP."""
    rows = [["diffuse scene", "method", "picture / Mitsuba's", "its standard error", "worst tile, standard errors",
             "HDR-FLIP, one rendering", "HDR-FLIP, half of them (Mitsuba's own)"]]
    for m in compared(results):
        ratio, error = (sum(m["picture"][key]) / 3 for key in ("ratio", "relative_error"))
        flips = ["", ""]
        if m["flip"] is not None:
            own = m["flip"]["mitsuba"]["half"]
            flips = [f"{m['flip'][m['method']]['one']:.4f}", f"{m['flip'][m['method']]['half']:.4f} ({own:.4f})"]
        rows.append([m["scene"], m["name"], f"{ratio:.4f}", f"{error:.4f}", f"{abs(m['worst']['standard_errors']):.1f}", *flips])
    return rows


@block
def mitsuba_worst(results: Results) -> str:
    """The largest difference of a tile's mean from Mitsuba's in standard errors."""
    return f"{max(abs(m['worst']['standard_errors']) for m in compared(results)):.1f}"


@block
def mitsuba_tiles(results: Results) -> str:
    """How many means of tiles were compared."""
    return f"{sum(m['tiles'] for m in compared(results)):,}"


@block
def mitsuba_spread(results: Results) -> str:
    """Least and most root mean square of differences in standard errors. Noise alone gives about 1."""
    return span([m["root_mean_square"] for m in compared(results)], 2)


@block
def mitsuba_times(results: Results) -> Rows:
    """Times of path tracing beside Mitsuba's."""
    rows = [["diffuse scene", "cores", "Mitsuba's variant", "wfpg-render, s", "Mitsuba, s", "times as fast", "by CPU time"]]
    for scene in results.json(TIMES, "scenes"):
        for row in scene["rows"]:
            seconds, ratios = row["wall"]["seconds"], [row[kind]["ratio"] for kind in ("wall", "cpu")]
            cells = [f"{r['median']:.2f} ({r['lower']:.2f} to {r['upper']:.2f})" for r in ratios]
            rows.append([scene["scene"], str(row["cores"]), f"`{row['variant']}`", three(seconds["pt"]), three(seconds[row["variant"]]),
                         *cells])
    return rows
