#!/usr/bin/env python3
"""Compares wfpg-render with Mitsuba 3 in diffuse scenes: means of tiles, and times.

Both programs read the diffuse variant of a glTF scene, with equal camera and lights. Paths have equal depth and no roulette.
README.md beside this script says what becomes of a scene.
"""
import argparse
import functools
import json
import math
import os
import pathlib
import platform
import re
import sys
import tempfile
import time
from typing import Any, Callable, Dict, List, Optional, Tuple

sys.dont_write_bytecode = True  # the sources' folder stays as it is
HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "upbp_scenes"))

from comparison_error import ComparisonError  # noqa: E402
from diffuse import write_diffuse  # noqa: E402
from exr_file import Picture, read_exr, write_exr  # noqa: E402, tools/upbp_scenes
from flip import mean_flip  # noqa: E402
from gltf_scene import read_gltf  # noqa: E402
from mitsuba_scene import MitsubaWriter  # noqa: E402
from renderers import Job, Mitsuba, Renderer, Wfpg, check_cores, check_mitsuba  # noqa: E402
from speed import measure  # noqa: E402
from tiles import compared, is_equal, tile_means  # noqa: E402

Json = Dict[str, Any]
METHODS = ("pt", "bpt", "wfpg", "wfpg-product", "sarsa")  # of wfpg-render, without bias


def size(text: str) -> str:
    """Checks WIDTHxHEIGHT."""
    if not re.fullmatch(r"[1-9]\d{0,4}x[1-9]\d{0,4}", text):
        raise argparse.ArgumentTypeError(f"{text} is not WIDTHxHEIGHT")
    return text


def at_least(least: int) -> Callable[[str], int]:
    """A whole number that is not below `least`."""
    def read(text: str) -> int:
        if not text.isdigit() or int(text) < least:
            raise argparse.ArgumentTypeError(f"{text} is no whole number from {least}")
        return int(text)
    return read


def words(*known: str) -> Callable[[str], List[str]]:
    """A list with commas between its words, which are known unless none are."""
    def read(text: str) -> List[str]:
        found = text.split(",")
        for word in found:
            if not word or (known and word not in known):
                raise argparse.ArgumentTypeError(f"'{word}' is not one of {', '.join(known)}" if known else "a word is missing")
        return found
    return read


def numbers(text: str) -> List[int]:
    """Whole numbers from 1, with commas between them."""
    return [at_least(1)(word) for word in text.split(",")]


def grid(text: str) -> Tuple[int, int]:
    """COLUMNSxROWS as two numbers."""
    columns, rows = size(text).split("x")
    return int(columns), int(rows)


def parser() -> argparse.ArgumentParser:
    """The options of all commands."""
    text = __doc__ or ""
    top = argparse.ArgumentParser(description=text.partition("\n\n")[0], epilog=text.partition("\n\n")[2])
    commands = top.add_subparsers(dest="command", required=True)
    convert = commands.add_parser("convert", help="write the diffuse variant of a scene, or Mitsuba's scene of it")
    convert.add_argument("scene", type=pathlib.Path, metavar="SCENE", help=".glb or .gltf")
    convert.add_argument("--write-diffuse", type=pathlib.Path, metavar="OUT.glb", help="for wfpg-render")
    convert.add_argument("--write-mitsuba", type=pathlib.Path, metavar="FOLDER", help="of scene.xml, meshes and textures")
    both = argparse.ArgumentParser(add_help=False)
    both.add_argument("scenes", type=pathlib.Path, nargs="+", metavar="SCENE", help=".glb or .gltf")
    both.add_argument("-o", "--output", type=pathlib.Path, required=True, metavar="OUT.json")
    both.add_argument("--program", type=pathlib.Path, required=True, metavar="PATH", help="wfpg-render")
    both.add_argument("--python", default=sys.executable, help="one that has Mitsuba (default: this one)")
    both.add_argument("--size", type=size, default="128x128", help="of pictures (default: %(default)s)")
    both.add_argument("--depth", type=at_least(2), default=8, help="segments of a path (default: %(default)s)")
    tiles = commands.add_parser("tiles", parents=[both], help="compare means of tiles, and HDR-FLIP",
                                description="Compares means of tiles. Exits with 1 where one deviates by more than the limit.")
    tiles.add_argument("--methods", type=words(*METHODS), default="pt,wfpg", help="of wfpg-render (default: %(default)s)")
    tiles.add_argument("--samples", type=at_least(1), default=256, help="a pixel and rendering (default: %(default)s)")
    tiles.add_argument("--runs", type=at_least(4), default=16, help="renderings of each (default: %(default)s)")
    tiles.add_argument("--tiles", type=grid, default=(8, 8), metavar="COLUMNSxROWS", help="(default: 8x8)")
    tiles.add_argument("--limit", type=float, default=5.0, help="of deviations, standard errors (default: %(default)s)")
    times = commands.add_parser("times", parents=[both], help="compare times in alternating pairs")
    times.add_argument("--samples", type=at_least(2), default=16, help="a pixel and rendering on one core; N cores render N times as many "
                       "(default: %(default)s)")
    times.add_argument("--pairs", type=at_least(1), default=21, help="(default: %(default)s)")
    times.add_argument("--cores", type=numbers, help="numbers of cores (default: 1,2 and all)")
    times.add_argument("--variants", type=words(), default="scalar_rgb", help="of Mitsuba, such as scalar_rgb,llvm_ad_rgb (default: %(default)s)")
    return top


def check_output(path: pathlib.Path) -> None:
    """Throws ComparisonError where a file cannot be written."""
    folder = path.parent if str(path.parent) else pathlib.Path(".")
    if not folder.is_dir():
        raise ComparisonError(f"{path}: there is no folder {folder}")
    if path.is_dir() or not os.access(path if path.exists() else folder, os.W_OK):
        raise ComparisonError(f"{path}: cannot be written")


def check(given: argparse.Namespace) -> None:
    """Throws ComparisonError where anything is missing, before work begins."""
    check_output(given.output)
    if not os.access(given.program, os.X_OK) or given.program.is_dir():
        raise ComparisonError(f"--program {given.program}: is no program")
    for scene in given.scenes:
        read_gltf(scene)
    check_mitsuba(given.python, getattr(given, "variants", []))
    if given.command == "tiles":
        columns, rows = given.tiles
        width, height = map(int, given.size.split("x"))
        if columns > width or rows > height:
            raise ComparisonError(f"--tiles {columns}x{rows}: there are {width}x{height} pixels")


def write_json(path: pathlib.Path, results: Json) -> None:
    """Writes results with the command that made them."""
    command = " ".join([pathlib.Path(sys.argv[0]).name, *sys.argv[1:]])
    path.write_text(json.dumps({"command": command, "machine": machine(), **results}, indent=1) + "\n", encoding="utf-8")


def machine() -> str:
    """CPU and cores."""
    try:
        names = re.findall(r"^model name\s*:\s*(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        names = []
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


class Prepared:
    """A scene's files for both programs, in a folder."""

    def __init__(self, source: pathlib.Path, folder: pathlib.Path) -> None:
        self.name, self.glb = source.stem, folder / f"{source.stem}.glb"
        write_diffuse(read_gltf(source), self.glb)
        writer = MitsubaWriter(read_gltf(self.glb), folder / "mitsuba")
        self.xml = writer.write()
        self.triangles = writer.triangles


def say(scene: str, text: str) -> None:
    """A line of progress."""
    print(f"{scene}: {text}", file=sys.stderr, flush=True)


def mean_picture(paths: List[pathlib.Path], out: pathlib.Path) -> pathlib.Path:
    """Writes the mean of pictures."""
    pictures = [read_exr(path) for path in paths]
    first = pictures[0]
    rows = [[type(channel)("f", (math.fsum(p.rows[y][c][x] for p in pictures) / len(pictures) for x in range(first.width)))
             for c, channel in enumerate(row)] for y, row in enumerate(first.rows)]
    write_exr(out, Picture(first.width, rows))
    return out


def render_runs(renderer: Renderer, scene: str, given: argparse.Namespace, folder: pathlib.Path) -> List[pathlib.Path]:
    """Pictures of all seeds."""
    paths, begin = [], time.monotonic()
    for run in range(given.runs):
        paths.append(folder / f"{renderer.name}-{run}.exr")
        renderer.render(given.samples, run + 1, paths[-1])
        left = (time.monotonic() - begin) / (run + 1) * (given.runs - run - 1)
        say(scene, f"{renderer.name}, rendering {run + 1} of {given.runs}, {left:.0f} s left")
    renderer.close()
    return paths


def flips(pictures: Dict[str, List[pathlib.Path]], folder: pathlib.Path, python: str) -> Optional[Json]:
    """HDR-FLIP against Mitsuba's mean, by method: of one rendering, and of the mean of half of them. Also of Mitsuba's own."""
    halves = {}
    for name, paths in pictures.items():
        middle = len(paths) // 2
        halves[name] = [mean_picture(part, folder / f"{name}-half-{i}.exr") for i, part in enumerate((paths[:middle], paths[middle:]))]
    reference = halves["mitsuba"][0]
    asked = [(reference, path) for name in pictures for path in (halves[name][1], pictures[name][-1])]
    errors = mean_flip(asked, python)
    if errors is None:
        return None
    return {name: {"half": errors[2 * i], "one": errors[2 * i + 1]} for i, name in enumerate(pictures)}


def compare_scene(scene: Prepared, given: argparse.Namespace, folder: pathlib.Path) -> Json:
    """Tiles and HDR-FLIP of a scene."""
    cores, job, methods = len(os.sched_getaffinity(0)), Job(given.size, given.depth), given.methods
    theirs = Mitsuba(given.python, "scalar_rgb", scene.xml, job, cores)
    pictures = {"mitsuba": render_runs(theirs, scene.name, given, folder)}
    for method in methods:
        pictures[method] = render_runs(Wfpg(given.program, scene.glb, job, cores, method), scene.name, given, folder)
    means = {name: [tile_means(read_exr(path).rows, *given.tiles) for path in paths] for name, paths in pictures.items()}
    found: Json = {"scene": scene.name, "triangles": scene.triangles, "mitsuba": theirs.versions["mitsuba"], "methods": {}}
    found["flip"] = flips(pictures, folder, given.python)
    for method in methods:
        comparison = compared(means[method], means["mitsuba"], given.tiles[0])
        comparison["equal"] = is_equal(comparison, given.limit)
        found["methods"][method] = comparison
        whole, worst = comparison["picture"], comparison["worst"]
        ratios = ", ".join(f"{r:.4f}" if r else "-" for r in whole["ratio"])
        print(f"{scene.name} {method}: picture {ratios} of Mitsuba's; worst of {comparison['tiles']} tile means: "
              f"{worst['standard_errors']:.2f} standard errors (column {worst['column']}, row {worst['row']}, {worst['channel']}), root "
              f"mean square {comparison['root_mean_square']:.2f}; largest ratio {comparison['largest']['ratio']}: "
              f"{'equal' if comparison['equal'] else 'DIFFERENT'}", flush=True)
    return found


def time_scene(scene: Prepared, given: argparse.Namespace, cores: List[int]) -> Json:
    """Times of a scene by variant and number of cores."""
    job, rows = Job(given.size, given.depth), []
    for variant in given.variants:
        for count in cores:
            try:
                theirs = Mitsuba(given.python, variant, scene.xml, job, count)
                name = f"{scene.name}, {count} cores, {variant}"
                row = measure(Wfpg(given.program, scene.glb, job, count), theirs, given.samples * count, given.pairs,
                              functools.partial(say, name))
                theirs.close()
            except ComparisonError as reason:
                if variant == "scalar_rgb":
                    raise
                say(scene.name, f"{variant} is left out: {str(reason)[:200]}")
                break
            rows.append({"variant": variant, "cores": count, **row})
            found = {kind: row[kind]["ratio"] for kind in ("wall", "cpu")}
            ratios = " and ".join(f"{r['median']:.3f} ({r['lower']:.3f} to {r['upper']:.3f}) by {k} time" for k, r in found.items())
            print(f"{name}: wfpg-render is {ratios} times as fast", flush=True)
    return {"scene": scene.name, "triangles": scene.triangles, "rows": rows}


def main() -> int:
    given = parser().parse_args()
    if given.command == "convert":
        if not given.write_diffuse and not given.write_mitsuba:
            raise ComparisonError("convert needs --write-diffuse, --write-mitsuba, or both")
        with tempfile.TemporaryDirectory() as folder:
            glb = given.write_diffuse or pathlib.Path(folder) / "scene.glb"
            check_output(glb)
            write_diffuse(read_gltf(given.scene), glb)
            if given.write_mitsuba:
                print(f"mitsuba {MitsubaWriter(read_gltf(glb), given.write_mitsuba).write()}")
        return 0
    check(given)
    have = len(os.sched_getaffinity(0))
    cores = getattr(given, "cores", None) or sorted({1, min(2, have), have})
    check_cores(cores)
    settings = {key: getattr(given, key) for key in ("size", "depth", "samples")}
    settings["pairs" if given.command == "times" else "runs"] = given.pairs if given.command == "times" else given.runs
    results: List[Json] = []
    for source in given.scenes:
        with tempfile.TemporaryDirectory() as folder:
            scene = Prepared(source, pathlib.Path(folder))
            results.append(compare_scene(scene, given, pathlib.Path(folder)) if given.command == "tiles"
                           else time_scene(scene, given, cores))
        write_json(given.output, {**settings, "scenes": results})
    return 0 if given.command == "times" or all(m["equal"] for s in results for m in s["methods"].values()) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ComparisonError as reason:
        sys.exit(f"error: {reason}")
    except OSError as reason:
        sys.exit(f"error: {reason.filename}: {reason.strerror}")
    except KeyboardInterrupt:
        sys.exit("interrupted")
