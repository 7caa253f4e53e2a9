"""HDR-FLIP of pairs of pictures. usage: python3 flip.py PAIRS.json OUT.json
The exit code is 3 if flip-evaluator is missing, or numpy, whose arrays hold the pictures."""
import json
import math
import sys

try:
    import flip_evaluator
    import numpy  # noqa: F401
except ImportError:
    sys.exit(3)


def mean_error(reference, test):
    mean = float(flip_evaluator.evaluate(reference, test, "HDR", applyMagma=False)[1])
    return mean if math.isfinite(mean) else None


with open(sys.argv[1]) as file:
    pairs = json.load(file)
with open(sys.argv[2], "w") as file:
    json.dump([mean_error(*pair) for pair in pairs], file)
