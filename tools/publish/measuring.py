"""Measures series, and writes their files and where they come from. An interrupted run resumes where it was."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
from typing import Any, Dict, List, Optional

from blocks import ROOT
from provenance import RESULTS, head, is_dirty, is_stale, provenance, read_index, sources, write_index
from series import ALL, Series

sys.path.append(str(ROOT / "bench"))
from programs import gpu_and_driver  # noqa: E402, bench/programs.py


class Place:
    """Where is measured: the repository, the programs' folder, that of the literature's scenes, and that of work."""

    def __init__(self, root: pathlib.Path, programs: pathlib.Path, scenes: Optional[pathlib.Path], work: pathlib.Path) -> None:
        self.root, self.programs, self.scenes, self.work = root.resolve(), programs.resolve(), scenes, work.resolve()

    def lacks(self, series: Series) -> List[str]:
        """What a series needs and this machine does not have."""
        has = {"gpu": lambda: bool(gpu_and_driver()), "several GPUs": lambda: "\n" in gpu_and_driver(),
               "scenes": lambda: self.scenes is not None, "Open PGL": self.has_openpgl, "Mitsuba": has_mitsuba,
               "OptiX": self.has_optix, "UPBP's scenes": self.has_upbp_scenes}
        return [need for need in series.needs if not (has[need]() if need in has else shutil.which(need))]

    def has_optix(self) -> bool:
        """Whether bench_cuda was built with OptiX, whose entry it then looks up by name."""
        program = self.programs / "bench_cuda"
        return program.exists() and b"optixQueryFunctionTable" in program.read_bytes()

    def has_upbp_scenes(self) -> bool:
        """Whether the scenes of the UPBP paper, which tools/upbp_scenes converts, are beside the others."""
        return self.scenes is not None and (self.scenes / "mirrorballs.gltf").exists()

    def has_openpgl(self) -> bool:
        """Whether the renderer has Open PGL: without it, the program names no such library."""
        program = self.programs / "wfpg-render"
        return program.exists() and b"libopenpgl" in program.read_bytes()


def has_mitsuba() -> bool:
    """Whether the python3 of PATH has Mitsuba."""
    done = subprocess.run(["python3", "-c", "import mitsuba"], capture_output=True, check=False)
    return done.returncode == 0


def compiler(programs: pathlib.Path) -> str:
    """The compiler that built the programs, by CMake's cache above their folder."""
    for folder in (programs, *programs.parents[:2]):
        if (folder / "CMakeCache.txt").exists():
            found = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.*)$", (folder / "CMakeCache.txt").read_text(), re.MULTILINE)
            done = subprocess.run([found[1], "--version"], capture_output=True, text=True, check=False) if found else None
            if done and done.returncode == 0:
                return done.stdout.split("\n")[0]
    return "an unknown compiler"


def machine(programs: pathlib.Path) -> str:
    """CPU, cores, compiler and GPU."""
    try:
        names = re.findall(r"^model name\s*:\s*(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        names = []
    parts = [names[0] if names else "an unknown CPU", f"{os.cpu_count()} cores", compiler(programs), gpu_and_driver()]
    return ", ".join(p for p in parts if p)


def state(root: pathlib.Path, series: Series) -> str:
    """"current", "stale", "unknown" or "missing". A file of other commands is stale."""
    index = read_index(root)
    name = series.name if series.name in index else series.name.split("#")[0]
    if name not in index:
        return "missing"
    entry = provenance(root, name)
    if entry["commit_is"] != "measured" or entry["command"] != list(series.commands):
        return "stale"
    return {True: "stale", False: "current", None: "unknown"}[is_stale(root, entry)]


def list_series(place: Place) -> None:
    """Prints each series, its state, about how long it takes, and what this machine lacks for it. Then files of no series."""
    print(f"{'file':32} {'state':8} minutes  left out, since there is no")
    for series in ALL:
        print(f"{series.name:32} {state(place.root, series):8} {series.minutes:7}  {', '.join(place.lacks(series))}")
    made = {series.name.split("#")[0] for series in ALL}
    print("by hand:", ", ".join(name for name in read_index(place.root) if name.split("#")[0] not in made))


def link(path: pathlib.Path, target: pathlib.Path) -> None:
    """Makes a link anew."""
    if path.is_symlink():
        path.unlink()
    path.symlink_to(target)


def build(programs: pathlib.Path) -> None:
    """Builds programs that CMake built before, so that they are of the sources that are checked out."""
    if (programs.parent / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "--build", str(programs.parent)], check=True)


def run(place: Place, series: Series, again: bool) -> pathlib.Path:
    """Runs the commands of a series in their folder, and returns the file that they made. `again`: without its caches."""
    name = series.name.split("#")[0]
    folder = place.work / series.name.replace("#", "-").rsplit(".", 1)[0]
    if again and folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    link(folder / "bin", place.programs)
    link(folder / "bench", place.root / "bench")
    if place.scenes:
        link(folder / "scenes", place.scenes.resolve())
    if "#" in series.name and (place.root / RESULTS / name).exists():
        shutil.copy(place.root / RESULTS / name, folder / name)  # the commands replace their part of it
    paths = [place.programs, place.root / "bench", place.root / "bench" / "ranks", place.root / "tools" / "mitsuba"]
    environment: Dict[str, str] = {**os.environ, "PATH": os.pathsep.join([*map(str, paths), os.environ["PATH"]])}
    for command in series.commands:
        print(f"  {command}", flush=True)
        subprocess.run(command, shell=True, cwd=folder, env=environment, check=True)
    return folder / series.made


def without_runs(text: str) -> str:
    """A result of wfpg-quality without single renderings; its summary stays."""
    results = json.loads(text)
    for scene in results["scenes"]:
        scene.pop("runs", None)
    return json.dumps(results, indent=1, ensure_ascii=False) + "\n"


def record(place: Place, series: Series, made: pathlib.Path, measured: Dict[str, Any]) -> None:
    """Takes over a file that was made, and writes its entry. `measured`: the commit and the sources' hash before the run."""
    target = place.root / RESULTS / series.name.split("#")[0]
    part = target.with_name(target.name + ".part")
    part.write_text(made.read_text() if series.keeps_runs else without_runs(made.read_text()))
    os.replace(part, target)
    index = read_index(place.root)
    index[series.name] = {**measured, "commit_is": "measured",
                          "date": time.strftime("%Y-%m-%d", time.gmtime()), "machine": machine(place.programs),
                          "command": list(series.commands)}
    write_index(place.root, index)


def measure(place: Place, names: List[str], again: bool) -> int:
    """Measures series by name, or all. Passes over those that are current, unless `again`. Returns how many failed."""
    unknown = [name for name in names if not any(name in (s.name, s.name.rsplit(".", 1)[0]) for s in ALL)]
    if unknown:
        raise SystemExit(f"publish.py: there is no series {', '.join(unknown)}; --list has all")
    if head(place.root) is None:
        raise SystemExit("publish.py: --measure needs git, to say at which commit it measures")
    if is_dirty(place.root):
        raise SystemExit("publish.py: include/, examples/, bench/ or tools/ have changes: commit them before measuring")
    build(place.programs)
    chosen = [s for s in ALL if not names or s.name in names or s.name.rsplit(".", 1)[0] in names]
    failed = 0
    for number, series in enumerate(chosen, 1):
        title = f"[{number}/{len(chosen)}] {series.name}"
        lacks = place.lacks(series)
        if lacks:
            print(f"{title}: left out, since there is no {' or '.join(lacks)}")
        elif not again and state(place.root, series) == "current":
            print(f"{title}: current")
        else:
            print(f"{title}: about {series.minutes} minutes", flush=True)
            begin = time.monotonic()
            measured = {"commit": head(place.root), "sources": sources(place.root)}
            try:
                record(place, series, run(place, series, again), measured)
                print(f"{title}: written after {(time.monotonic() - begin) / 60:.1f} minutes")
            except (subprocess.CalledProcessError, OSError) as error:
                print(f"{title}: failed: {error}", file=sys.stderr)
                failed += 1
    return failed
