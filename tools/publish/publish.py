#!/usr/bin/env python3
"""Keeps the figures of README.md and docs/ equal to the files of bench/results, and measures these files.

usage: tools/publish/publish.py --check             fails where a block differs from its file, or a figure has no block
       tools/publish/publish.py --write             marks stale results, and generates all blocks anew
       tools/publish/publish.py --list              prints all series, and whether they are current
       tools/publish/publish.py --measure [NAME...] measures all series or those, passing over current ones; then --write
       tools/publish/publish.py --planted           plants faults in copies of pages, and fails where one is not found

--help has all options. pages.py says what a block is, series.py what is measured, and exceptions.ini which figures are no results.
"""
import argparse
import json
import pathlib
import sys
from typing import Dict, List, Set

import bidirectional_blocks  # registers its blocks
import host_blocks  # registers its blocks
import mitsuba_blocks  # registers its blocks
import option_blocks  # registers its blocks
import performance_blocks  # registers its blocks
import quality_blocks  # registers its blocks
import ranks_blocks  # registers its blocks
import results_blocks  # registers its blocks
from blocks import ROOT, Results, generate
from measuring import Place, list_series, measure
from pages import BLOCK, INLINE, Exempt, differing, faults_of_markers, outside, read_exceptions, rewrite
from plots import PLOTS, differing_plots, drawn, write_plots
from provenance import RESULTS, Entry, is_marked_wrongly, is_stale, provenance, read_index, result_files, sources, write_index

EXCEPTIONS = pathlib.Path(__file__).resolve().parent / "exceptions.ini"

def page_names(root: pathlib.Path) -> List[str]:
    """The pages that are checked: README.md and docs/*.md."""
    return ["README.md", *sorted(f"docs/{p.name}" for p in (root / "docs").glob("*.md"))]


def check_page(results: Results, page: str, text: str, exceptions: List[Exempt], used: Set[Exempt]) -> List[str]:
    """Faults of one page, as lines."""
    def make(name: str, of_page: str) -> str:
        return generate(results, name, of_page)
    found = [*differing(text, page, make).items(), *faults_of_markers(text),
             *((line, f"{figure} stands outside a block") for line, figure in outside(text, page, exceptions, used))]
    return [f"{page}:{line}: {what}" for line, what in sorted(found)]


def parts_of(root: pathlib.Path, name: str) -> Set[str]:
    """The names FILE#KEY of a result file's parts."""
    if not name.endswith(".json"):
        return set()
    found = json.loads((root / RESULTS / name).read_text())
    return {f"{name}#{key}" for key in found if f"{key}_command" in found}


def check_index(root: pathlib.Path, index: Dict[str, Entry]) -> List[str]:
    """Result files without commit or date, and entries without a file. A file has an entry, or each part of it has one."""
    files, found = result_files(root), []
    for name in files:
        missing = {name} if not (parts := parts_of(root, name)) else parts
        if name not in index:
            found += [f"bench/results/index.json has no {wanted}" for wanted in sorted(missing - set(index))]
    gone = [name for name in index if name.split("#")[0] not in files]
    found += [f"bench/results/index.json has {name}, and there is no such file" for name in gone]
    entries = {name: provenance(root, name) for name in index if name not in gone}
    found += [f"bench/results/index.json: {name} has no {key}" for name, entry in entries.items()
              for key in ("commit", "commit_is", "date", "command", "machine") if not entry.get(key)]
    return found


def check_marks(root: pathlib.Path, index: Dict[str, Entry]) -> List[str]:
    """Entries whose marks are wrong."""
    return [f"bench/results/index.json: {name} is {'not ' if entry.get('stale') else ''}stale, and not marked so; run publish.py --write"
            for name, entry in index.items() if is_marked_wrongly(root, entry)]


def check_shown(root: pathlib.Path, files: List[str], in_blocks: Set[str]) -> List[str]:
    """Result files that nobody sees: no block or plot is made from them, and no page but the list of all names them."""
    pages = [page for page in (*page_names(root), "CONTRIBUTING.md") if page != "docs/results.md"]
    texts = [(root / path).read_text(encoding="utf-8") for path in (*pages, *(script for script, *_ in PLOTS))]
    shown = {*in_blocks, *(result for _, result, *_ in PLOTS)}
    return [f"bench/results/{name} is in no page and no plot: show it or remove it" for name in files
            if name not in shown and not any(name in text for text in texts)]


def mark_stale(root: pathlib.Path) -> None:
    """Marks what was measured from other sources, so that pages say so. Where that is unknown, marks stay."""
    index = read_index(root)
    for name, entry in index.items():
        if is_marked_wrongly(root, entry):
            entry["stale"] = not entry.get("stale")
            print(f"{name}: {'stale' if entry['stale'] else 'current'}")
    write_index(root, index)


def report_stale(root: pathlib.Path) -> None:
    """Prints which results were measured before sources changed. That is no fault."""
    states: Dict[str, List[str]] = {"stale": [], "current": [], "unknown": []}
    for name, entry in read_index(root).items():
        state = {True: "stale", False: "current", None: "unknown"}[is_stale(root, entry)]
        states[state].append(f"{name} ({entry.get('commit')})")
    print(f"{len(states['current'])} results are current, {len(states['stale'])} are stale: include/, examples/, bench/ or "
          f"tools/ changed since their commit; of {len(states['unknown'])} it is unknown")
    for state in ("current", "stale", "unknown"):
        for name in states[state]:
            print(f"  {state}: {name}")


def check(root: pathlib.Path) -> List[str]:
    """All faults of the pages, the plots and the index."""
    results, exceptions = Results(root), read_exceptions(EXCEPTIONS)
    used: Set[Exempt] = set()
    index = read_index(root)
    found = check_index(root, index) + check_marks(root, index) + differing_plots(root, drawn(root))
    for page in page_names(root):
        found += check_page(results, page, (root / page).read_text(encoding="utf-8"), exceptions, used)
    found += check_shown(root, result_files(root), results.files())
    found += [f"exceptions.ini: [{e.kind}] {e.pattern.pattern} covers nothing in {e.pages}" for e in exceptions
              if e not in used]
    return found


def write(root: pathlib.Path) -> None:
    """Marks stale results, generates the blocks of all pages, and draws the plots."""
    mark_stale(root)
    write_plots(root)
    results = Results(root)
    for page in page_names(root):
        text = (root / page).read_text(encoding="utf-8")
        for line, fault in faults_of_markers(text):
            raise SystemExit(f"publish.py: {page}:{line}: {fault}")
        try:
            new = rewrite(text, page, lambda name, of_page: generate(results, name, of_page))
        except (KeyError, IndexError, ValueError, OSError) as error:
            raise SystemExit(f"publish.py: {page} cannot be generated: {error}") from error
        if new != text:
            (root / page).write_text(new, encoding="utf-8")
            print(f"{page}: written")


def planted(root: pathlib.Path) -> List[str]:
    """Faults that are planted in a copy of each page's text and not found."""
    exceptions, missed = read_exceptions(EXCEPTIONS), []
    page = "docs/quality.md"
    text = (root / page).read_text(encoding="utf-8")
    table, figure = BLOCK.search(text), INLINE.search(text)
    assert table and figure
    at = next(i for i in range(table.start("body"), table.end("body")) if text[i].isdigit())
    faults = {
        "a changed figure in a table": text[:at] + str((int(text[at]) + 1) % 10) + text[at + 1:],
        "a changed figure in a sentence": text[:figure.start("body")] + "1" + text[figure.start("body"):],
        "a block that does not exist": text.replace(table["begin"], "<!-- publish: no-such-block -->\n", 1),
        "a key that does not exist": text.replace(figure["begin"], "<!-- p: records-time no-such-scene -->", 1),
        "a block that does not end": text.replace("<!-- /publish -->", "", 1),
        "a figure at the beginning of a line": text + f"\n{figure[0]}\n",
        "a gain outside a block": text + "\nThis gains 2.57 in all scenes.\n",
        "a factor outside a block": text + "\nIt is 32 times faster.\n",
        "a time outside a block": text + "\nA sample takes 12 ms.\n",
        "bytes outside a block": text + "\nFields take 13 MiB.\n",
        "an error outside a block": text + "\nMeans differ by 3%.\n",
        "a negative figure outside a block": text + "\nThe difference is -3%.\n",
        "a time over a line's end": text + "\nA sample takes 12\nms.\n",
        "a factor with a sign": text + "\nIt is 3× faster.\n",
        "a power of ten outside a block": text + "\nThe error is 4e-5.\n",
        "a cell with a second figure": text + "\n| scene | gain |\n| --- | --- |\n| ajar | 32 (5) |\n",
        "a figure after a stray backquote": text + "\nA stray ` here.\n\nIt takes 12 ms, and ` there.\n",
        "a marker without a blank": text + "\n<!--publish: builtin -->\n",
        "a table outside a block": text + "\n| scene | gain |\n| --- | --- |\n| ajar | 32 |\n",
    }
    for name, changed in faults.items():
        before = len(check_page(Results(root), page, text, exceptions, set()))
        if len(check_page(Results(root), page, changed, exceptions, set())) <= before:
            missed.append(f"not found: {name}")
    index = read_index(root)
    for name in (name for name in index if "#" not in name and not parts_of(root, name) or name.split("#")[0] not in index):
        if not check_index(root, {other: entry for other, entry in index.items() if other != name}):
            missed.append(f"not found: an index without {name}")
    if len(check_shown(root, ["no-such-result.json"], set())) != 1:
        missed.append("not found: a result that no page shows")
    unmarked = {name: {**entry, "sources": "0" * 12, "stale": False} for name, entry in index.items()}
    if sources(root) and len(check_marks(root, unmarked)) < len(index):  # without git nothing is known
        missed.append("not found: results of other sources that are not marked")
    changed_plots = {path: plot + " " for path, plot in drawn(root).items()}
    if len(differing_plots(root, changed_plots)) < len(changed_plots):
        missed.append("not found: a changed plot")
    return missed


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--check", action="store_true", help="fail where a page differs from its results")
    what.add_argument("--write", action="store_true", help="generate all blocks anew")
    what.add_argument("--planted", action="store_true", help="fail where a planted fault is not found")
    what.add_argument("--list", action="store_true", help="print the series and their states")
    what.add_argument("--measure", nargs="*", metavar="NAME", help="measure these series, or all")
    parser.add_argument("--again", action="store_true", help="measure current series, too")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="the repository (default: this one)")
    parser.add_argument("--programs", type=pathlib.Path, help="folder of programs (default: build/bench-cuda/bin or build/bench/bin)")
    parser.add_argument("--scenes", type=pathlib.Path, help="folder with the literature's scenes as glTF")
    parser.add_argument("--work", type=pathlib.Path, help="folder of pictures, references and caches (default: build/publish)")
    return parser.parse_args()


def place_of(given: argparse.Namespace) -> Place:
    """Where to measure."""
    built = [given.root / "build" / preset / "bin" for preset in ("bench-cuda", "bench")]
    programs = given.programs or next((p for p in built if p.exists()), built[-1])
    return Place(given.root, programs, given.scenes, given.work or given.root / "build" / "publish")


def main() -> int:
    """Runs the program, and returns its exit status."""
    given = arguments()
    if given.list:
        list_series(place_of(given))
        return 0
    failed = 0
    if given.measure is not None:
        place = place_of(given)
        if not place.programs.is_dir():
            raise SystemExit(f"publish.py: no programs in {place.programs}; build them by: cmake --workflow --preset bench")
        failed = measure(place, given.measure, given.again)
    if given.write or given.measure is not None:
        write(given.root)
        return 1 if failed else 0
    faults = planted(given.root) if given.planted else check(given.root)
    for fault in faults:
        print(fault, file=sys.stderr)
    if given.check:
        report_stale(given.root)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
