"""Compares two renderers' pictures by means of tiles, whose standard errors come from independent renderings."""
import array
import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

Rows = List[List["array.array[float]"]]  # of a picture: red, green and blue of each row
CHANNELS = "rgb"


class Mean(NamedTuple):
    """A mean over renderings, and its standard error."""
    value: float
    error: float


class Deviation(NamedTuple):
    """A tile's channel, by column and row: ratio of the means, and their difference in standard errors."""
    column: int
    row: int
    channel: str
    ratio: Optional[float]  # None where the other's mean is 0
    standard_errors: float


def tile_means(rows: Rows, columns: int, lines: int) -> List[float]:
    """Means of tiles, row by row, each red, green and blue. Sides of tiles differ by one pixel where they must."""
    height, width = len(rows), len(rows[0][0])
    found = []
    for line in range(lines):
        first, last = line * height // lines, (line + 1) * height // lines
        for column in range(columns):
            left, right = column * width // columns, (column + 1) * width // columns
            for channel in range(3):
                total = math.fsum(math.fsum(rows[y][channel][left:right]) for y in range(first, last))
                found.append(total / ((last - first) * (right - left)))
    return found


def mean(values: Sequence[float]) -> Mean:
    """Mean and standard error of at least two values."""
    n, middle = len(values), math.fsum(values) / len(values)
    return Mean(middle, math.sqrt(math.fsum((v - middle) ** 2 for v in values) / (n - 1) / n))


def difference(a: Mean, b: Mean) -> float:
    """a - b in standard errors; 0 where both are equal and have none."""
    error = math.hypot(a.error, b.error)
    if error > 0.0:
        return (a.value - b.value) / error
    return 0.0 if a.value == b.value else math.copysign(math.inf, a.value - b.value)


def deviations(ours: List[List[float]], theirs: List[List[float]], columns: int) -> List[Deviation]:
    """All tiles and channels. Each list has the tile means of one rendering."""
    found = []
    for index, (a, b) in enumerate(zip(map(mean, zip(*ours)), map(mean, zip(*theirs)))):
        tile, channel = divmod(index, 3)
        ratio = a.value / b.value if b.value else None
        found.append(Deviation(tile % columns, tile // columns, CHANNELS[channel], ratio, difference(a, b)))
    return found


def compared(ours: List[List[float]], theirs: List[List[float]], columns: int) -> Dict[str, Any]:
    """The comparison as JSON: the whole picture, the worst tiles, and all tiles."""
    all_tiles = deviations(ours, theirs, columns)
    whole = [[[math.fsum(run[c::3]) / len(run[c::3]) for c in range(3)] for run in runs] for runs in (ours, theirs)]
    pairs = [[mean([run[c] for run in runs]) for runs in whole] for c in range(3)]
    worst = max(all_tiles, key=lambda d: abs(d.standard_errors))
    lit = [d for d in all_tiles if d.ratio is not None]
    largest = max(lit, key=lambda d: abs((d.ratio or 1.0) - 1.0), default=worst)
    return {"picture": {"ratio": [a.value / b.value if b.value else None for a, b in pairs],
                        "standard_errors": [difference(a, b) for a, b in pairs],
                        "relative_error": [math.hypot(a.error, b.error) / b.value if b.value else None for a, b in pairs]},
            "tiles": len(all_tiles), "worst": worst._asdict(), "largest": largest._asdict(),
            "root_mean_square": math.sqrt(math.fsum(d.standard_errors ** 2 for d in all_tiles) / len(all_tiles)),
            "all": [[d.column, d.row, d.channel, d.ratio and round(d.ratio, 5), round(d.standard_errors, 2)] for d in all_tiles]}


def is_equal(comparison: Dict[str, Any], limit: float) -> bool:
    """Whether neither a tile nor the whole picture deviates by more than `limit` standard errors."""
    whole = comparison["picture"]["standard_errors"]
    largest: float = max(abs(comparison["worst"]["standard_errors"]), *map(abs, whole))
    return largest <= limit
