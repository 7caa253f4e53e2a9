"""Tables and figures of docs/ranks.md: what ranks send, what it costs, and how they scale."""
import math
import sys
from typing import Any, Dict, List, Tuple

from blocks import ROOT, Results, Rows, block, span, three

sys.path.append(str(ROOT / "bench" / "ranks"))
from plot import NETWORK, WARM_UP, WAVE, Model, fit, models, reduction  # noqa: E402, bench/ranks/plot.py

FILE = "ranks.json"
GPUS = ("1", "2", "4", "8")


def sent(results: Results, scene: str) -> List[float]:
    """MiB of each sample of a large picture, by two processes."""
    return results.json(FILE, "processes", scene, "1920x1080", "2", "mib")


@block
def ranks_traffic(results: Results) -> Rows:
    """MiB that a rank sends in samples of warm-up, and after it in those that are recorded and others."""
    last = len(sent(results, "ajar"))
    after = f"{WARM_UP + 1} to {last}"
    rows = [["scene", f"samples 11 to {WARM_UP}, warm-up", f"recorded, {after}", f"others, {after}", f"mean, {after}"]]
    for scene in ("ajar", "bathroom"):
        mib = sent(results, scene)
        later = mib[WARM_UP:]
        recorded = [m for m in later if m > 1.0]  # others send a third of that
        others = [m for m in later if m <= 1.0]
        rows.append([scene, span(mib[10:WARM_UP]), span(recorded), span(others, 2), f"{sum(later) / len(later):.1f}"])
    return rows


@block
def ranks_first(results: Results) -> str:
    """Most MiB of the first ten samples."""
    return f"{max(max(sent(results, scene)[:10]) for scene in ('ajar', 'bathroom')):.1f} MiB"


def part(results: Results, scene: str, ranks: str, when: str) -> Dict[str, float]:
    """Seconds of a sample by what they are for."""
    return results.json(FILE, "processes", scene, "640x360", ranks, when)


@block
def ranks_cost(results: Results) -> Rows:
    """CPU time of packing and reducing beside all."""
    rows = [["scene", "samples", "all", "packing", "reducing", "both"]]
    for scene in ("ajar", "bathroom"):
        for when, samples in (("later", "33 to 40"), ("warm_up", "2 to 32, warm-up")):
            p = part(results, scene, "2", when)
            both = (p["packing"] + p["reducing"]) / p["all"]
            rows.append([scene, samples, f"{1e3 * p['all']:.0f}", f"{1e3 * p['packing']:.1f}", f"{1e3 * p['reducing']:.1f}",
                         f"{100 * both:.1f}%"])
    return rows


def modelled(results: Results, scene: str) -> Tuple[Dict[str, Any], Model]:
    """Runs of a scene by number of ranks, and the model that fits them."""
    return next((runs, model) for name, _, runs, model in models({"processes": results.json(FILE, "processes")}) if name == scene)


@block
def ranks_model(results: Results) -> Rows:
    """CPU time of a sample and of its reductions, measured and modelled."""
    rows = [["scene", "processes", "a sample", "model", "reductions", "model"]]
    for scene in ("ajar", "bathroom"):
        runs, model = modelled(results, scene)
        for n, run in sorted(runs.items(), key=lambda item: int(item[0])):
            seconds = (run["later"]["all"], model.seconds(int(n), model.costs))
            sums = (run["later"]["reducing"], reduction(int(n), run["later"], model.costs))
            rows.append([scene, n, *(f"{1e3 * s:.0f}" for s in seconds), *(f"{1e3 * s:.2f}" for s in sums)])
    return rows


@block
def ranks_network(results: Results) -> str:
    """What the model has for a call and for a MiB, and how many a sample has."""
    model = modelled(results, "ajar")[1]
    return (f"{1e6 * model.costs['call']:.0f} µs a call and {1e3 * model.costs['mib']:.2f} ms a MiB, with "
            f"{model.part['calls']:.0f} calls and {model.part['mib']:.1f} MiB a sample")


@block
def ranks_model_over(results: Results, ranks: str) -> str:
    """Reductions of the model over those that were measured."""
    ratios = []
    for scene in ("ajar", "bathroom"):
        runs, model = modelled(results, scene)
        later = runs[ranks]["later"]
        ratios.append(reduction(int(ranks), later, model.costs) / later["reducing"])
    return f"{span(ratios)} times"


@block
def ranks_beyond(results: Results, what: str) -> str:
    """Of 1,024 modelled ranks in ajar: ms that each is `alone`, speed over one, that with a `wave`, ms of `sums`."""
    model = modelled(results, "ajar")[1]
    if what == "alone":
        return f"{1e3 * model.alone:.0f} ms"
    if what == "sums":
        return f"{1e3 * reduction(1024, model.part, NETWORK):.1f} ms"
    samples = {"speed": 1, "wave": WAVE}[what]
    return f"{model.seconds(1, NETWORK, samples) / model.seconds(1024, NETWORK, samples):.0f} times"


def renderings(results: Results, *keys: str) -> List[Tuple[str, int, Dict[str, float]]]:
    """Scene, samples and mean seconds by number of GPUs, of the long renderings or the short ones, which `keys` lead to."""
    return [(scene, found["spp"], {n: sum(s) / len(s) for n, s in found["samples"].items()})
            for scene, found in results.json(FILE, *keys).items()]


def faster(seconds: Dict[str, float]) -> str:
    """How many times as fast as one GPU the others are."""
    return ", ".join(f"{seconds['1'] / s:.2f}" for n, s in seconds.items() if n != "1")


@block
def ranks_gpus(results: Results) -> Rows:
    """Seconds of renderings by number of GPUs, and the model that fits the long ones."""
    numbers = [str(n) for n in results.json(FILE, "gpus", "numbers")]
    rows = [["scene", "samples", *(f"{n} GPU" if n == "1" else n for n in numbers), "times as fast as 1, and model"]]
    for kind in ("scenes", "short"):
        for scene, spp, seconds in renderings(results, "gpus", kind):
            divided, alone = fit({int(n): s for n, s in seconds.items()})
            model = f"; {divided:.1f} / n + {alone:.2f}" if kind == "scenes" else ""
            rows.append([scene, str(spp), *(three(seconds[n]) for n in numbers), faster(seconds) + model])
    return rows


@block
def ranks_eight(results: Results) -> Rows:
    """Seconds by eight GPUs, which were measured before."""
    rows = [["scene", "samples", "1 GPU", "8", "times as fast"]]
    for kind in ("scenes", "short"):
        for scene, spp, seconds in renderings(results, kind):
            rows.append([scene, str(spp), *map(three, seconds.values()), faster(seconds)])
    return rows


@block
def ranks_gpu_model(results: Results) -> str:
    """The largest difference of the model from what was measured."""
    most = 0.0
    for _, _, seconds in renderings(results, "gpus", "scenes"):
        divided, alone = fit({int(n): s for n, s in seconds.items()})
        most = max([most, *(abs((divided / int(n) + alone) / s - 1) for n, s in seconds.items())])
    return f"{math.ceil(100 * most)}%"


@block
def ranks_joining(results: Results) -> str:
    """Seconds to join GPUs."""
    return "{:.1f}, {:.1f} and {:.1f} s".format(*results.json(FILE, "nccl", "seconds_to_join").values())


@block
def ranks_ends(results: Results, gpus: str) -> str:
    """Part of a rendering of ajar that ends of samples take."""
    stages = results.json(FILE, "gpus", "stages", "ajar", gpus)
    return f"{100 * stages['update'] / stages['total']:.0f}%"


@block
def ranks_tiles(results: Results) -> str:
    """Samples of ajar with one a wave, and seconds by number of GPUs."""
    found = results.json(FILE, "gpus", "scenes", "ajar")
    *first, last = (f"{seconds[0]:.1f}" for seconds in found["tiles"].values())
    return f"{found['tiles_spp']} samples of ajar take {', '.join(first)} and {last} s"


@block
def ranks_alone(results: Results) -> str:
    """Seconds of ajar by one GPU without ranks."""
    return f"{results.json(FILE, 'gpus', 'scenes', 'ajar', 'alone', 0):.1f} s"


@block
def nccl(results: Results) -> Rows:
    """Times of NCCL's calls."""
    found = results.json(FILE, "nccl")
    names = {"microseconds_of_32_bytes": "sum of 32 bytes, µs",
             "microseconds_of_32_bytes_not_blocking": "by a communicator that does not block, µs",
             "microseconds_of_1_mib": "sum of 1 MiB, µs",
             "bus_gb_a_second_of_256_mib": "sum of 256 MiB, GB/s that each link carries"}
    return [["", "2 GPUs", "4", "8"], *([name, *(f"{found[key][n]:.0f}" for n in GPUS[1:])] for key, name in names.items())]


@block
def nccl_copy(results: Results) -> str:
    """Rate of a copy between two GPUs."""
    return f"{results.json(FILE, 'nccl', 'peer_copy_gb_a_second'):.0f} GB/s"
