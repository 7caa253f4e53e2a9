"""Plots of docs/ that scripts of bench/ draw from result files."""
import pathlib
import subprocess
import sys
import tempfile
from typing import Dict, List, Tuple

from provenance import RESULTS

# Scripts, the result file of each, or "" for the folder of all, where it writes in an empty folder, and the plots that it draws there.
PLOTS: Tuple[Tuple[str, str, str, Tuple[str, ...]], ...] = (
    ("bench/quality_plots.py", "", "", ("gains.svg", "error-over-time.svg", "single-samples.svg")),
    ("bench/stages_plot.py", "", "roofline.svg", ("roofline.svg",)),
    ("bench/tuning_plot.py", "tuning.json", "tuning.svg", ("tuning.svg",)),
    ("bench/ranks/plot.py", "ranks.json", "", ("ranks-how.svg", "ranks-traffic.svg", "ranks-scaling.svg")),
)


def drawn(root: pathlib.Path) -> Dict[str, str]:
    """The plots as they are drawn from today's results, by path from the root."""
    found = {}
    for script, result, to, names in PLOTS:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, str(root / script), str(root / RESULTS / result), str(pathlib.Path(folder) / to)],
                           check=True, stdout=subprocess.DEVNULL)
            found.update({f"docs/{name}": (pathlib.Path(folder) / name).read_text(encoding="utf-8") for name in names})
    return found


def differing_plots(root: pathlib.Path, plots: Dict[str, str]) -> List[str]:
    """Plots of docs/ that are missing, or not as drawn."""
    return [f"{path} is not what --write draws" for path, text in plots.items()
            if not (root / path).exists() or (root / path).read_text(encoding="utf-8") != text]


def write_plots(root: pathlib.Path) -> None:
    """Draws plots that differ."""
    plots = drawn(root)
    for path, text in plots.items():
        if differing_plots(root, {path: text}):
            (root / path).write_text(text, encoding="utf-8")
            print(f"{path}: written")
