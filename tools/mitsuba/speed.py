"""Times of two renderers in alternating pairs."""
import statistics
from typing import Any, Callable, Dict, List, Tuple

from renderers import Renderer, Times


def interval_of_median(values: List[float]) -> Tuple[float, float]:
    """The interval of order statistics that has the median with at least 95%; least and most where values are few."""
    ordered, n = sorted(values), len(values)
    below, tail, term = 0, 0.0, 0.5 ** n  # tail: the probability of at most `below` - 1 values under the median
    while tail + term <= 0.025 and below < (n - 1) // 2:
        tail += term
        below += 1
        term *= (n - below + 1) / below
    first = max(below - 1, 0)
    return ordered[first], ordered[n - 1 - first]


def ratio(values: List[float]) -> Dict[str, float]:
    """Median of ratios, and its interval."""
    lower, upper = interval_of_median(values)
    return {"median": statistics.median(values), "lower": lower, "upper": upper}


def measure(ours: Renderer, theirs: Renderer, samples: int, pairs: int, say: Callable[[str], None]) -> Dict[str, Any]:
    """Renders `pairs` times by each, first the one, then the other, and in turn. Ratios above 1: ours is faster."""
    times: Dict[str, List[Times]] = {"ours": [], "theirs": []}
    for renderer in (ours, theirs):
        renderer.render(min(samples, 2), 0)
    for pair in range(pairs):
        order = [("ours", ours), ("theirs", theirs)]
        for who, renderer in order if pair % 2 == 0 else reversed(order):
            times[who].append(renderer.render(samples, pair + 1))
        say(f"pair {pair + 1} of {pairs}: {times['ours'][-1].wall:.2f} s, {theirs.name} {times['theirs'][-1].wall:.2f} s")
    result: Dict[str, Any] = {}
    for kind in ("wall", "cpu"):
        a, b = ([getattr(t, kind) for t in times[who]] for who in ("ours", "theirs"))
        result[kind] = {"seconds": {ours.name: statistics.median(a), theirs.name: statistics.median(b)},
                        "ratio": ratio([y / x for x, y in zip(a, b)])}
    return result
