"""Mean HDR-FLIP of two pictures, by the script of tools/quality."""
import json
import pathlib
import subprocess
import sys
import tempfile
from typing import List, Optional, Tuple

SCRIPT = pathlib.Path(__file__).resolve().parents[1] / "quality" / "flip.py"
MISSING = 3  # the script's exit code


def mean_flip(pairs: List[Tuple[pathlib.Path, pathlib.Path]], python: str) -> Optional[List[Optional[float]]]:
    """The mean HDR-FLIP error of each pair of OpenEXR files, reference first. None where the packages are missing, with a message."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answer = pathlib.Path(folder) / "pairs.json", pathlib.Path(folder) / "errors.json"
        asked.write_text(json.dumps([[str(path) for path in pair] for pair in pairs]))
        done = subprocess.run([python, str(SCRIPT), str(asked), str(answer)], check=False, stdout=subprocess.DEVNULL)
        if done.returncode == MISSING:
            print(f"without HDR-FLIP, for which {python} needs two packages: {python} -m pip install flip-evaluator numpy", file=sys.stderr)
            return None
        done.check_returncode()
        errors: List[Optional[float]] = json.loads(answer.read_text())
        return errors
