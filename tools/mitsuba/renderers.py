"""Both renderers behind one call: what a rendering takes, and its picture."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from typing import Any, Dict, List, NamedTuple, Optional, Protocol

from comparison_error import ComparisonError

HERE = pathlib.Path(__file__).resolve().parent
EXR_FOLDER = HERE.parent / "upbp_scenes"  # has exr_file.py
LARGEST_DEPTH = str(1 << 30)  # of roulette, which ends no path


class Times(NamedTuple):
    """Seconds of a rendering without reading its scene. cpu: of all threads, None where it is unknown."""
    wall: float
    cpu: Optional[float]


class Job(NamedTuple):
    """What both programs render. Depth counts segments of a path."""
    size: str
    depth: int


class Renderer(Protocol):
    """A program with a scene."""
    name: str

    def render(self, samples: int, seed: int, picture: Optional[pathlib.Path] = None) -> Times:
        """Renders, and writes a picture where one is asked for."""

    def close(self) -> None:
        """Ends what still runs."""


def start(command: List[str], cores: int, **options: Any) -> "subprocess.Popen[str]":
    """Starts a program that may use the first `cores` of this process's cores."""
    own = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(own)[:cores])
    try:
        return subprocess.Popen(command, text=True, **options)
    except OSError as reason:
        raise ComparisonError(f"{command[0]}: {reason.strerror}") from reason
    finally:
        os.sched_setaffinity(0, own)


class Wfpg:
    """wfpg-render, one process a rendering."""

    def __init__(self, program: pathlib.Path, scene: pathlib.Path, job: Job, cores: int, method: str = "pt") -> None:
        self.name, self._cores = method, cores
        self._command = [str(program.resolve()), str(scene), "--method", method, "--size", job.size, "--max-depth", str(job.depth),
                         "--roulette-depth", LARGEST_DEPTH]

    def render(self, samples: int, seed: int, picture: Optional[pathlib.Path] = None) -> Times:
        """Renders. CPU seconds are those beyond a rendering of one sample, times N / (N - 1)."""
        times = self._run(samples, seed, picture)
        if samples < 2 or picture is not None:
            return Times(times.wall, None)
        assert times.cpu is not None
        return Times(times.wall, (times.cpu - (self._run(1, seed, None).cpu or 0.0)) * samples / (samples - 1))

    def _run(self, samples: int, seed: int, picture: Optional[pathlib.Path]) -> Times:
        """One process. CPU seconds are all of it."""
        with tempfile.TemporaryDirectory() as folder:
            stats, errors = pathlib.Path(folder) / "stats.json", pathlib.Path(folder) / "errors.txt"
            out = picture or pathlib.Path(folder) / "out.exr"
            with open(errors, "w+", encoding="utf-8") as messages:
                process = start([*self._command, "--spp", str(samples), "--seed", str(seed), "-o", str(out), "--stats", str(stats)],
                                self._cores, stdout=subprocess.DEVNULL, stderr=messages)
                _, status, used = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
                if process.returncode != 0:
                    messages.seek(0)
                    raise ComparisonError(f"{' '.join(self._command)}: failed: {messages.read()[-2000:].strip()}")
            seconds = json.loads(stats.read_text())["seconds"]
        return Times(seconds["total"] - seconds.get("embree", 0.0) - seconds.get("bvh", 0.0), used.ru_utime + used.ru_stime)

    def close(self) -> None:
        """Nothing runs."""


class Mitsuba:
    """Mitsuba 3, in one process that stays."""

    def __init__(self, python: str, variant: str, scene: pathlib.Path, job: Job, cores: int) -> None:
        self.name = variant
        self._errors = tempfile.TemporaryFile("w+", encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(EXR_FOLDER), os.environ.get("PYTHONPATH", "")])}
        self._process = start([python, str(HERE / "server.py"), variant, str(cores), str(scene), job.size, str(job.depth)], cores,
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, env=environment)
        self.versions = self._answer()

    def _answer(self) -> Dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            self._errors.seek(0)
            raise ComparisonError(f"Mitsuba's {self.name} ended: {self._errors.read()[:2000].strip()}")
        answer: Dict[str, Any] = json.loads(line)
        return answer

    def render(self, samples: int, seed: int, picture: Optional[pathlib.Path] = None) -> Times:
        """Renders in the process that waits."""
        assert self._process.stdin is not None
        asked = {"samples": samples, "seed": seed, "picture": str(picture) if picture else None}
        try:
            self._process.stdin.write(json.dumps(asked) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # _answer says why
        answer = self._answer()
        return Times(answer["seconds"], answer["cpu_seconds"])

    def close(self) -> None:
        """Ends the process."""
        if self._process.stdin:
            self._process.stdin.close()
        self._process.wait()
        self._errors.close()


def check_mitsuba(python: str, variants: List[str]) -> None:
    """Throws ComparisonError where a Python cannot be run, has no Mitsuba 3, or one without such variants."""
    try:
        done = subprocess.run([python, "-c", "import drjit, mitsuba; print(mitsuba.__version__, *mitsuba.variants())"], capture_output=True, text=True,
                              check=False)
    except OSError as reason:
        raise ComparisonError(f"--python {python}: {reason.strerror}") from reason
    if done.returncode != 0 or not done.stdout.startswith("3."):
        raise ComparisonError(f"{python} has no Mitsuba 3: give --python one that has, after PYTHON -m pip install mitsuba")
    known = done.stdout.split()[1:]
    for variant in variants:
        if variant not in known:
            raise ComparisonError(f"--variants {variant}: Mitsuba has {', '.join(known)}")


def check_cores(cores: List[int]) -> None:
    """Throws ComparisonError where this process may not use so many cores."""
    have = len(os.sched_getaffinity(0)) if sys.platform == "linux" else 0
    if not have:
        raise ComparisonError("numbers of cores can be limited on Linux alone")
    for wanted in cores:
        if not 1 <= wanted <= have:
            raise ComparisonError(f"--cores {wanted}: this process may use {have}")
