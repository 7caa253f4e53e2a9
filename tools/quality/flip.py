"""HDR-FLIP of pairs of pictures. usage: python3 flip.py PAIRS.json OUT.json; exit code 3 where flip-evaluator
or numpy, which it hands pictures over in, are missing."""
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
