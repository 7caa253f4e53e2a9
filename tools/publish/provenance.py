"""Where results come from: command, commit, machine and date of each file of bench/results, and whether it is stale.

bench/results/index.json has what the files do not say themselves. `commit_is` tells how a commit is known: "measured" at
it, as the file or its program said, or "log": the file came with that commit, so that it was measured shortly before.
`stale` marks what was measured from other sources than those that are checked out; pages then say "older code".
Where a part of a JSON file has another commit, the index has an entry FILE#KEY for it, too. `sources` is a hash of what was
measured.
"""
import hashlib
import json
import pathlib
import re
import subprocess
from typing import Any, Dict, List, Optional

RESULTS = "bench/results"
INDEX = f"{RESULTS}/index.json"
# What results depend on. The results themselves, and this program, do not change what is measured.
SOURCES = ("include", "examples", "bench", "tools", f":!{RESULTS}", ":!tools/publish", ":!tools/upbp_scenes", ":!*.md",
           ":!bench/table.py", ":!bench/svg.py", ":!bench/quality_plots.py", ":!bench/stages_plot.py", ":!bench/tuning_plot.py",
           ":!bench/ranks/plot.py")

Entry = Dict[str, Any]


def read_index(root: pathlib.Path) -> Dict[str, Entry]:
    """The index by name of file; empty where there is none."""
    path = root / INDEX
    return json.loads(path.read_text()) if path.exists() else {}


def write_index(root: pathlib.Path, index: Dict[str, Entry]) -> None:
    """Writes the index in the order of names."""
    text = json.dumps(dict(sorted(index.items())), indent=1, ensure_ascii=False)
    (root / INDEX).write_text(text + "\n")


def result_files(root: pathlib.Path) -> List[str]:
    """Names of all result files, without the index."""
    return sorted(p.name for p in (root / RESULTS).iterdir() if p.name != "index.json")


def _machine(value: Any, gpu: str) -> str:
    """One line for a machine of a result file: a text, or the fields that wfpg-quality writes."""
    if isinstance(value, dict):
        parts = [value.get("processor", ""), f"{value['threads']} threads" if "threads" in value else "",
                 f"g++ {value['compiler']}" if re.match(r"\d", value.get("compiler", "")) else value.get("compiler", ""),
                 value.get("gpu_and_driver", "")]
        return ", ".join(p for p in parts if p)
    return value or gpu


def provenance(root: pathlib.Path, name: str) -> Entry:
    """commit, commit_is, date, machine and commands of a result file: what it says, and else what the index says."""
    entry = dict(read_index(root).get(name, {}))
    if "#" in name:
        file, part = name.split("#")
        entry.setdefault("command", json.loads((root / RESULTS / file).read_text()).get(f"{part}_command", []))
    elif name.endswith(".json"):
        found = json.loads((root / RESULTS / name).read_text())
        command = found.get("command") or found.get("render")
        if command:
            entry.setdefault("command", command)
        machine = _machine(found.get("machine"), found.get("gpu_and_driver", ""))
        if machine:
            entry.setdefault("machine", machine)
    else:
        commands = re.findall(r"^ {4}((?:wfpg-|g\+\+ |ncu |build/|test_)\S*(?:.*\\\n)*.*)$", (root / RESULTS / name).read_text(), re.MULTILINE)
        entry.setdefault("command", commands)
    command = entry.get("command", [])
    entry["command"] = [command] if isinstance(command, str) else list(command)
    return entry


def _git(root: pathlib.Path, *arguments: str) -> Optional[subprocess.CompletedProcess]:
    """Runs git; None where there is no git."""
    try:
        return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False)
    except OSError:
        return None


def head(root: pathlib.Path) -> Optional[str]:
    """The short hash of the commit that is checked out; None without a history."""
    done = _git(root, "rev-parse", "--short=7", "HEAD")
    return done.stdout.strip() if done and done.returncode == 0 else None


def is_dirty(root: pathlib.Path, untracked: bool = True) -> bool:
    """Whether sources differ from the commit that is checked out. `untracked`: also by files that git does not track."""
    done = _git(root, "status", "--porcelain", f"--untracked-files={'normal' if untracked else 'no'}", "--", *SOURCES)
    return bool(done and done.stdout.strip())


def sources(root: pathlib.Path) -> Optional[str]:
    """A hash of the sources that are checked out, which stays where commits are rebased. None without git."""
    done = _git(root, "ls-files", "--stage", "--", *SOURCES)
    return hashlib.sha256(done.stdout.encode()).hexdigest()[:12] if done and done.returncode == 0 and done.stdout else None


def is_stale(root: pathlib.Path, entry: Entry) -> Optional[bool]:
    """Whether sources changed since an entry was measured: by their hash, or else by its commit. None where neither is known."""
    now = sources(root)
    if now is None:
        return None
    if "sources" in entry:
        return is_dirty(root, untracked=False) or entry["sources"] != now
    done = _git(root, "diff", "--quiet", entry["commit"], "--", *SOURCES)
    return {0: False, 1: True}.get(done.returncode) if done else None


def is_marked_wrongly(root: pathlib.Path, entry: Entry) -> bool:
    """Whether an entry is marked stale and is not, or the reverse. False where that is unknown."""
    stale = is_stale(root, entry)
    return stale is not None and stale != bool(entry.get("stale"))
