#!/usr/bin/env python3
"""Compares methods with paths from lights with path tracing on the GPU, at equal time, and writes results for tools/publish.

usage: bench/both_ends.py DIRECTORY_OF_PROGRAMS OUT.json [SECONDS [REFERENCE_SECONDS [SIZE [SCENE...]]]]

Renders each scene with each method for SECONDS (3), with two seeds. Two references take REFERENCE_SECONDS (8) each, or four
times as long in bottles, and have other seeds. An error is the mean of both seeds against both references, less half the
difference between the references, which is their own noise. vcm-all merges all photons where they are dense. upbp-more has beams
of more light paths than upbp, and all photons along camera beams. Scenes that OUT has stay in it, but for those that are measured
and those whose references took another time. They must have the same settings.
"""
import statistics
import sys
import tempfile

from programs import ERRORS, Programs, begin_results, errors_without_noise, write_results

# The first method of each is the one that others are compared with.
SURFACES = {"pt": ("pt",), "wfpg": ("wfpg",), "bpt": ("bpt",), "vcm": ("vcm",),
            "vcm-all": ("vcm", "--dense-photons", "1000000000")}
MEDIA = {"vpt": ("vpt",), "bpt": ("bpt",), "vcm": ("vcm",), "bpt+pp3d": ("bpt", "--techniques", "bpt+pp3d"),
         "bpt+pb2d": ("bpt", "--techniques", "bpt+pb2d"), "bpt+bb1d": ("bpt", "--techniques", "bpt+bb1d"), "upbp": ("upbp",),
         "upbp-more": ("upbp", "--beam-paths", "2048", "--beam-point-paths", "1000000")}
SCENES = {"caustic-pool": SURFACES, "mirror-balls": SURFACES, "veach-bidir": SURFACES, "fog-spot": MEDIA, "glass-caustic-fog": MEDIA,
          "bottles": MEDIA, "wax": MEDIA}
# Other scenes' are by bpt, which finds light of wax's flames that path tracing misses. In bottles it finds less than path tracing.
REFERENCES = {"bottles": ("vpt",)}
REFERENCE_TIMES = {"bottles": 4.0}
REFERENCE_SEEDS = {"a": 901, "b": 902}
SEEDS = (1, 2)


def reference_time(scene, reference_seconds):
    return REFERENCE_TIMES.get(scene, 1.0) * reference_seconds


def measure(programs, scene, methods, seconds, reference_seconds):
    def render(name, method, seconds, seed):
        return programs.render(scene, name, ["--method", *method, "--seconds", str(seconds), "--seed", str(seed)])

    for name, seed in REFERENCE_SEEDS.items():
        render(name, REFERENCES.get(scene, ("bpt",)), reference_seconds, seed)
    noise = programs.compare("a", "b")
    lines = {}
    for name, method in methods.items():
        samples, errors = [], []
        for seed in SEEDS:
            samples.append(render("x", method, seconds, seed)["spp"])
            errors += [programs.compare("x", reference) for reference in REFERENCE_SEEDS]
        lines[name] = {"spp": statistics.mean(samples), **errors_without_noise(errors, noise)}
    return {"scene": scene, "reference_seconds": reference_seconds,
            "reference_noise": {kind: noise[kind] for kind in ERRORS}, "methods": lines}


def main(directory, out, seconds="3", reference_seconds="8", size="480x270", *names):
    settings = {"seconds": float(seconds), "reference_seconds": float(reference_seconds), "size": size}
    results = begin_results(out)
    if results and any(results.get(name) != value for name, value in settings.items()):
        sys.exit(f"{out} has scenes of other settings")
    scenes = {scene["scene"]: scene for scene in results.get("scenes", [])
              if scene.get("reference_seconds") == reference_time(scene["scene"], settings["reference_seconds"])}
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(directory, size, folder)
        for name in names or SCENES:
            print(name, file=sys.stderr)
            scenes[name] = measure(programs, name, SCENES[name], settings["seconds"],
                                   reference_time(name, settings["reference_seconds"]))
    write_results(out, {**settings, "scenes": [scenes[name] for name in SCENES if name in scenes]})


if __name__ == "__main__":
    if len(sys.argv) < 3 or not set(sys.argv[6:]) <= set(SCENES):
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
