"""What blocks are generated from: result files, and functions by name that make a table or the figure of a sentence.

A function takes the results and the words that follow its name in the marker. It returns the rows of a table, the first of
them its head, or a text for a figure within a sentence.
"""
import json
import pathlib
import re
import sys
from typing import Any, Callable, Dict, List, Set, Union

from provenance import RESULTS, provenance, read_index

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench"))

from table import three  # noqa: E402,F401, bench/table.py; blocks import it from here

Rows = List[List[str]]
Block = Callable[..., Union[Rows, str]]
BLOCKS: Dict[str, Block] = {}


class Results:
    """Reads result files, and remembers which of them a block is made from."""

    def __init__(self, root: pathlib.Path) -> None:
        self.root = root
        self.read: List[str] = []
        self.index = read_index(root)
        self._texts: Dict[str, str] = {}
        self._values: Dict[str, Any] = {}

    def text(self, name: str, part: str = "") -> str:
        """The text of a file of bench/results. A part with a commit of its own is remembered as such."""
        if name not in self._texts:
            self._texts[name] = (self.root / RESULTS / name).read_text(encoding="utf-8")
        entry = f"{name}#{part}" if f"{name}#{part}" in self.index else name
        if entry not in self.read:
            self.read.append(entry)
        return self._texts[name]

    def json(self, name: str, *keys: Union[str, int]) -> Any:
        """A value of a JSON file, by the keys that lead to it."""
        text = self.text(name, str(keys[0]) if keys else "")
        if name not in self._values:
            self._values[name] = json.loads(text)
        value = self._values[name]
        for key in keys:
            if isinstance(value, dict) and key not in value:
                raise KeyError(f"{name} has no {'/'.join(map(str, keys))}")
            value = value[key]
        return value

    def files(self) -> Set[str]:
        """All files that blocks were made from so far."""
        return set(self._texts)

    def found(self, name: str, pattern: str) -> "re.Match[str]":
        """The one match of a pattern in a text file; lines are matched singly."""
        matches = list(re.finditer(pattern, self.text(name), re.MULTILINE))
        if len(matches) != 1:
            raise ValueError(f"{name} has {len(matches)} of {pattern}, one is wanted")
        return matches[0]


def block(function: Block) -> Block:
    """Registers a function. Underscores of its name are hyphens in markers."""
    BLOCKS[function.__name__.replace("_", "-")] = function
    return function


def span(values: List[float], digits: int = 1) -> str:
    """Least and most of values."""
    least, most = f"{min(values):.{digits}f}", f"{max(values):.{digits}f}"
    return least if least == most else f"{least} to {most}"


def per_cent(values: List[float]) -> str:
    """Least and most of values, in per cent."""
    return span([100 * value for value in values], 0) + "%"


def table(rows: Rows) -> str:
    """A table of Markdown."""
    head = ["| " + " | ".join(rows[0]) + " |", "| " + "--- | " * (len(rows[0]) - 1) + "--- |"]
    return "\n".join(head + ["| " + " | ".join(row) + " |" for row in rows[1:]]).replace("|  |", "| |").replace("|  |", "| |")


def source(root: pathlib.Path, name: str, page: str) -> str:
    """A file's commit and date, with a link to the list of results."""
    entry = provenance(root, name)
    link = "results.md" if page.startswith("docs/") else "docs/results.md"
    before, older = "before " if entry["commit_is"] == "log" else "", " (older code)" if entry.get("stale") else ""
    return f"[{name.split('#')[0]}]({link}), {before}commit {entry['commit']}{older}, {entry['date']}"


def generate(results: Results, name: str, page: str) -> str:
    """The text of a block of a page. A table ends with the files that it is made from."""
    word, *arguments = name.split()
    if word not in BLOCKS:
        raise KeyError(f"there is no block {word}")
    results.read = []
    made = BLOCKS[word](results, *arguments)
    if isinstance(made, str):
        return made
    sources = "; ".join(dict.fromkeys(source(results.root, file, page) for file in results.read))  # parts of a file may be alike
    return f"{table(made)}\n\n*{sources}.*"
