#!/usr/bin/env python3
"""Draws docs/roofline.svg: stages on a GPU beside their floors, and the pass of guided directions below the GPU's roofs.

usage: bench/stages_plot.py bench/results OUT.svg

It reads cuda-stages.json, cuda-casting.json and cuda-profile.txt. Source of the roofline by instructions: Ding & Williams 2019, "An
Instruction Roofline Model for GPUs". The roofs are an NVIDIA H200's: its data sheet's bandwidth, and its highest clock.
"""
import json
import pathlib
import re
import sys
from typing import Any, Dict, List, NamedTuple, Tuple

from svg import COLOURS, Plot, document, line, text
from table import FLOORS, with_casting

BYTES = 4.8e12  # a second, of the GPU's memory
INSTRUCTIONS = 132 * 4 * 1.98e9  # of warps, a second: multiprocessors, schedulers, and the highest clock
SECTOR = 32  # bytes, of the second-level cache
ORANGE, BLUE, GREEN = COLOURS[:3]
KINDS = {"copies of memory": BLUE, "sorts": GREEN, "rays, connections": ORANGE}  # of floors
ENDS = (0.01, 4.0)  # of parts of the floor's speed
ROW, LEFT, TOP, WIDTH = 19, 296, 62, 230


class Wave(NamedTuple):
    """A profiled wave of the pass over kept fields."""
    seconds: float
    memory: float  # bytes
    cache: float  # bytes of the second-level cache
    warps: float  # that are active, over those that a multiprocessor holds
    instructions: float  # of warps

    def part_of(self, roof: str) -> float:
        """What it reaches of a roof, `memory` or `instructions`."""
        return {"memory": self.memory / BYTES, "instructions": self.instructions / INSTRUCTIONS}[roof] / self.seconds


def waves_of(profile: str) -> List[Wave]:
    """The waves of cuda-profile.txt: microseconds, MB, registers, sectors, active warps, instructions."""
    rows = [line.replace(",", "").split() for line in re.findall(r"^ *\d+\.\d+ +\d+\.\d+ +\d+ +\d.*$", profile, re.MULTILINE)]
    if not rows:
        raise ValueError("cuda-profile.txt has no waves")
    return [Wave(float(r[0]) * 1e-6, float(r[1]) * 1e6, float(r[3]) * SECTOR, float(r[4]) / 100, float(r[5])) for r in rows]


def kind_of(stage: str) -> str:
    """What a stage's floor is made of."""
    floor = FLOORS[stage]
    if "rays" in floor or "connections" in floor:
        return "rays, connections"
    return "sorts" if "sort" in floor else "copies of memory"


def name_of(benchmark: Dict[str, Any]) -> Tuple[str, str]:
    """A benchmark's stage, and its arguments in words."""
    stage, *arguments = benchmark["name"].split("/iterations")[0].split("/")
    return stage, ", ".join(a.replace(":", " ").replace("_", " ") for a in arguments)


def draw_floors(benchmarks: List[Dict[str, Any]]) -> List[str]:
    """A bar for each stage: the floor's time over the stage's."""
    height = ROW * len(benchmarks)
    plot = Plot(LEFT, TOP, WIDTH, height, ENDS, (0.1, 1), (), (), "", "", True)
    parts = [text(14, 22, "Part of its floor's speed that a stage reaches", "font-weight='bold'")]
    x = 14.0
    for kind, colour in KINDS.items():
        parts.append(f"<rect x='{x:.0f}' y='32' width='11' height='11' fill='{colour}'/>")
        parts.append(text(x + 16, 42, f"floor: {kind}", "font-size='12' fill='#333'"))
        x += 76 + 6.4 * len(kind)
    for tick in (0.01, 0.1, 1):
        at = plot.x(tick)
        parts.append(line(at, TOP, at, TOP + height, f"stroke='{'#333' if tick == 1 else '#e4e4e4'}'"))
        parts.append(text(at, TOP + height + 16, f"{100 * tick:g}%", "text-anchor='middle' font-size='11'"))
    for i, b in enumerate(benchmarks):
        (stage, arguments), y = name_of(b), TOP + ROW * i
        reached = b["floor_ms"] / b["median_ms"]
        parts.append(text(LEFT - 8, y + 14, f"{stage} <tspan fill='#888' font-size='10'>{arguments}</tspan>",
                          "text-anchor='end' font-size='12'"))
        parts.append(f"<rect x='{LEFT}' y='{y + 3}' width='{plot.x(reached) - LEFT:.1f}' height='{ROW - 6}' "
                     f"fill='{KINDS[kind_of(stage)]}'/>")
        parts.append(text(plot.x(reached) + 4, y + 14, f"{100 * reached:.2g}%" if reached < 1 else f"{100 * reached:.0f}%",
                          "font-size='10' fill='#333'"))
    return parts


def draw_roofs(waves: List[Wave]) -> List[str]:
    """Instructions a second over instructions a byte, below the roofs of memory and of instructions."""
    plot = Plot(616, TOP, 250, 250, (0.05, 2), (100, 2000), (0.1, 0.2, 0.5, 1, 2), (100, 200, 500, 1000, 2000),
                "", "instructions of warps a byte", True)
    ridge = INSTRUCTIONS / BYTES
    plot.parts.append(text(566, 22, "Guided directions below the H200's roofs", "font-weight='bold'"))
    plot.parts.append(text(0, 0, "billion instructions of warps a second",
                           f"text-anchor='middle' fill='#555' transform='translate(576 {TOP + 125}) rotate(-90)'"))
    plot.curve([(0.05, 0.05 * BYTES * 1e-9), (ridge, INSTRUCTIONS * 1e-9), (2, INSTRUCTIONS * 1e-9)], "#333")
    plot.label(plot.x(0.3), plot.y(INSTRUCTIONS * 1e-9) - 7, "instructions", "#333")
    plot.label(plot.x(0.075), plot.y(720), "memory", "#333")
    for colour, name, moved in ((BLUE, "over bytes of memory", [w.memory for w in waves]),
                                (ORANGE, "over bytes of the second-level cache", [w.cache for w in waves])):
        points = [(w.instructions / b, w.instructions / w.seconds * 1e-9) for w, b in zip(waves, moved)]
        plot.dots(points, colour)
        plot.label(plot.left + 10, plot.top + plot.height - (26 if colour == BLUE else 10), name, colour)
    return plot.parts


def main(folder: str, out: str) -> None:
    """Draws the plot."""
    results = pathlib.Path(folder)
    benchmarks, casting = (json.loads((results / name).read_text(encoding="utf-8"))["benchmarks"]
                           for name in ("cuda-stages.json", "cuda-casting.json"))
    benchmarks = with_casting(benchmarks, casting)
    waves = waves_of((results / "cuda-profile.txt").read_text(encoding="utf-8"))
    height = TOP + ROW * len(benchmarks) + 30
    pathlib.Path(out).write_text(document(886, height, draw_floors(benchmarks) + draw_roofs(waves)), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
