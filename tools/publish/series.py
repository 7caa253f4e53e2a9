"""What is measured for the pages: each series is a result file, the commands that make it, and what they need.

Commands run in a folder of their own, where `bin` has the programs, `bench` this repository's scripts and `scenes` the scenes of
the literature. Programs and scripts are found without a path, too. So a command reads alike on each machine.
"""
from typing import Dict, NamedTuple, Tuple


class Series(NamedTuple):
    """A result file, or FILE#KEY for a part of one; its commands; what they need; and about how many minutes they take."""
    name: str
    commands: Tuple[str, ...]
    needs: Tuple[str, ...]
    minutes: int
    made: str = "results/results.json"  # by the commands, in their folder
    keeps_runs: bool = True  # each rendering's errors on the way, which pages seldom need


OVER_TIME = ("builtin-scenes.json", "quality-openpgl.json")  # of which errors on the way are shown
QUALITY = "wfpg-quality --cache cache --output results"
LITERATURE = ('"scenes/veach-ajar.glb --size 320x180" "scenes/bathroom.glb --size 240x240" "scenes/staircase2.glb --size 240x240" '
              '"scenes/cornell-box.glb --size 240x240" "scenes/veach-mis.glb --size 320x240"')
SMALL = ('"scenes/veach-ajar.glb --size 80x45" "scenes/bathroom.glb --size 64x64" "scenes/staircase2.glb --size 64x64" '
         '"scenes/cornell-box.glb --size 64x64" "scenes/veach-mis.glb --size 64x48"')


def quality(name: str, needs: Tuple[str, ...], minutes: int, scenes: str, rest: str) -> Series:
    """A series of wfpg-quality. On a GPU, unless methods name it themselves."""
    device = " --device cuda" if "gpu" in needs and "--device cuda" not in rest else ""
    return Series(name, (f"{QUALITY}{device} --scenes {scenes} {rest}",), needs, minutes, keeps_runs=name in OVER_TIME)


def methods(base: str, named: Dict[str, str]) -> str:
    """Methods of wfpg-quality that have `base` and more options."""
    arguments = {name: f"{base} {options}".strip() for name, options in named.items()}
    return " ".join(f'--method "{name}={a}"' for name, a in arguments.items())


def sarsa_methods(updates: Dict[str, Tuple[str, ...]]) -> str:
    """SARSA grids without next-event estimation, by update and sampler."""
    return " ".join(f'--method "{update}-{s}=--method sarsa --nee off --sarsa-update {update} --sarsa-sampler {s}"'
                    for update, samplers in updates.items() for s in samplers)


DIFFUSE = " ".join(f"scenes/{name}.glb" for name in ("cornell-box", "staircase2", "veach-ajar"))
DEEP = "--max-depth 16 --roulette-depth 8"
WITHOUT_NEE = methods("--nee off", {"pt": "--method pt", "wfpg": "--method wfpg", "records": "--method records"})
ALL_SAMPLERS = ("sphere", "hemisphere", "rejection", "mixed")
SARSA = f"--spp 64 --seconds 1 --seeds 1 --reference-spp 4096 --reference-chunk 2048 {WITHOUT_NEE} "
ROOM = ",".join(["cosine", "wfpg", "openpgl-pavmm", "openpgl-quadtree", *(f"cache-grid-{m}" for m in ("mean", "rms")),
                 *(f"exact-{d}-{m}" for d in ("grid", "quadtree") for m in ("mean", "rms")),
                 *(f"{d}-mean" for d in ("exact-blocks", "exact-caps", "recorded-grid", "recorded-quadtree", "recorded-caps"))])

ALL: Tuple[Series, ...] = (
    quality("builtin-scenes.json", (), 40,
            '"cornell-enclosed --nee off" ajar "thin-wall --max-depth 6" "glossy-room --nee off" cornell-box',
            "--size 128x128 --reference-spp 8192 --reference-chunk 4096 --seeds 3 --spp 64 "
            "--methods pt,wfpg,wfpg-product,wfpg-transient-oriented"),
    quality("octree-sources.json", (), 15, "cornell-box ajar cornell-enclosed glossy-room thin-wall caustic-pool",
            "--size 120x90 --spp 64 --seeds 4 --reference-spp 1024 --methods pt "
            + methods("--method wfpg --least-gain 0", {s: f"--octree {s}" for s in ("triangles", "caster", "samples")})),
    quality("quality-cones.json", (), 30, '"ajar --size 120x90" "cornell-enclosed --size 120x90"',
            "--spp 32 --seeds 3 --reference-spp 4096 --methods pt "
            + methods("--method wfpg", {"kept-scene": "", "kept-march": "--cones march", "kept-trace": "--cones trace",
                                        "kept-trace-all": "--cones trace --recast 1"}) + " "
            + methods("--method wfpg --fields transient", {"transient-scene": "", "transient-march": "--cones march",
                                                           "transient-trace": "--cones trace"})),
    Series("tuning.json", ("tuning.py bin tuning.json pictures",), (), 15, "tuning.json"),
    Series("fractions.json", ("guide_fractions.py bin fractions.json",), (), 20, "fractions.json"),
    Series("ceiling.json", ("guide_ceiling.py bin ceiling.json scenes",), ("scenes",), 120, "ceiling.json"),
    Series("rest.json#cpu", ("rests.py bin rest.json cpu scenes",), ("scenes",), 90, "rest.json"),
    Series("pairs.json#16", ("pairs.py bin pairs.json 16 scenes",), ("scenes",), 10, "pairs.json"),
    Series("pairs.json#64", ("pairs.py bin pairs.json 64 scenes",), ("scenes",), 35, "pairs.json"),
    Series("pairs.json#256", ("pairs.py bin pairs.json 256 scenes",), ("scenes",), 150, "pairs.json"),
    Series("room.json", (f"wfpg-room --methods {ROOM} --json room.json",), ("Open PGL",), 20, "room.json"),
    Series("room-64.json", ("wfpg-room --methods wfpg,openpgl-pavmm --samples 64 --json room-64.json",), ("Open PGL",), 10,
           "room-64.json"),
    Series("mitsuba-tiles.json", (f"compare.py tiles {DIFFUSE} -o mitsuba-tiles.json --program bin/wfpg-render --size 64x64",),
           ("scenes", "Mitsuba"), 30, "mitsuba-tiles.json"),
    Series("mitsuba-times.json", ("compare.py times scenes/cornell-box.glb scenes/staircase2.glb -o mitsuba-times.json "
                                  "--program bin/wfpg-render --size 256x256",), ("scenes", "Mitsuba"), 10, "mitsuba-times.json"),
    Series("compile-time.json", ("compile_time.py compile-time.json 10",), ("clang++",), 10, "compile-time.json"),
    Series("ranks.json#processes", tuple(f"measure.py bin/wfpg-render {scene} 640x360 {n} 40 ranks.json"
                                         for scene in ("ajar", "scenes/bathroom.glb") for n in (1, 2, 4, 8)),
           ("scenes", "mpirun", "perf"), 30, "ranks.json"),
    Series("ranks.json#gpus", ("gpus.py bin/wfpg-render ranks.json 2 ajar=3072 scenes/bathroom.glb=1536",),
           ("scenes", "several GPUs"), 10, "ranks.json"),
    quality("quality-openpgl.json", ("scenes", "Open PGL"), 120, LITERATURE,
            "--spp 256 --seeds 1 --reference-spp 8192 --reference-chunk 4096 --methods pt,wfpg "
            '--method "vmm-1000=--method openpgl-vmm --samples-per-leaf 1000"'),
    quality("quality-openpgl-sweep.json", ("scenes", "Open PGL"), 60, LITERATURE,
            "--spp 64 --seeds 1 --reference-spp 4096 --reference-chunk 2048 --methods pt,wfpg,wfpg-product "
            + methods("--method openpgl-vmm", {f"vmm-{n}": f"--samples-per-leaf {n}" for n in (250, 1000, 4000)})),
    Series("cuda-stages.json", ("bench_cuda --benchmark_out=cuda-stages.json --benchmark_out_format=json",), ("gpu",), 5,
           "cuda-stages.json"),
    Series("cuda-casting.json", ("bench_cuda --benchmark_filter=casting --benchmark_out=cuda-casting.json --benchmark_out_format=json",),
           ("gpu", "OptiX"), 1, "cuda-casting.json"),
    Series("cuda-equal-time.json", ("equal_time.py bin cuda-equal-time.json 10 40",), ("gpu",), 5, "cuda-equal-time.json"),
    Series("cuda-sample-times.json", ("sample_times.py bin cuda-sample-times.json 20",), ("gpu",), 5, "cuda-sample-times.json"),
    Series("cuda-both-ends.json", ("both_ends.py bin cuda-both-ends.json",), ("gpu",), 8, "cuda-both-ends.json"),
    Series("cuda-both-ends-large.json",
           ("both_ends.py bin cuda-both-ends-large.json 3 8 1920x1080 caustic-pool mirror-balls veach-bidir",), ("gpu",), 4,
           "cuda-both-ends-large.json"),
    Series("cuda-light-times.json", ("light_times.py bin cuda-light-times.json",), ("gpu",), 2, "cuda-light-times.json"),
    Series("cuda-upbp-times.json", ("upbp_times.py bin cuda-upbp-times.json scenes",), ("gpu", "UPBP's scenes"), 1,
           "cuda-upbp-times.json"),
    Series("rest.json#gpu", ("rests.py bin rest.json gpu scenes",), ("gpu", "scenes"), 5, "rest.json"),
    quality("quality-lights.json", ("gpu", "scenes"), 5,
            '"scenes/veach-mis.glb --size 320x240" "scenes/staircase2.glb --size 240x240" "many-lamps --size 240x180"',
            '--spp 64 256 --seeds 2 --reference-spp 4096 --reference-chunk 2048 --methods pt,wfpg '
            '--method "by-power=--method wfpg --light-groups 1"'),
    quality("quality-sarsa.json", ("gpu", "scenes"), 5,
            f'"scenes/veach-ajar.glb --size 480x270 {DEEP}" "scenes/bathroom.glb --size 360x360 {DEEP}"',
            SARSA + sarsa_methods({u: ALL_SAMPLERS for u in ("expected", "monte-carlo", "sarsa")})),
    quality("quality-sarsa-more.json", ("gpu", "scenes"), 5,
            f'"scenes/staircase2.glb --size 360x360 {DEEP}" "scenes/cornell-box.glb --size 360x360 {DEEP}" '
            f'"scenes/veach-mis.glb --size 400x300 {DEEP}"',
            SARSA + sarsa_methods({"sarsa": ALL_SAMPLERS, "expected": ("hemisphere",), "monte-carlo": ("hemisphere",)})),
    quality("quality-records.json", ("gpu",), 5,
            '"cornell-wall --size 512x512" "caustic-pool --size 512x512" "cornell-wall --size 512x512 --nee off" '
            '"caustic-pool --size 512x512 --nee off"',
            "--spp 30 --seeds 3 --reference-spp 16384 --reference-chunk 8192 --methods pt,records,sarsa,wfpg,wfpg-product"),
    quality("quality-paper-veach-ajar.json", ("gpu", "scenes"), 5, '"scenes/veach-ajar.glb --size 1920x1080"',
            "--spp 96 --seeds 1 --reference-spp 8192 --reference-chunk 4096 "
            "--methods pt,paper,paper-product,wfpg-transient-oriented,wfpg,wfpg-product"),
    quality("quality-paper-bathroom.json", ("gpu", "scenes"), 5, '"scenes/bathroom.glb --size 1920x1080"',
            "--spp 256 --seeds 1 --reference-spp 2048 --reference-chunk 1024 "
            "--methods pt,paper,paper-product,wfpg-transient-oriented,wfpg,wfpg-product"),
    quality("quality-series.json", ("gpu", "scenes"), 5,
            '"scenes/veach-ajar.glb --size 480x270" "scenes/bathroom.glb --size 360x360"',
            "--spp 64 --per-sample 64 --seeds 1 --reference-spp 4096 --reference-chunk 2048 "
            "--methods pt,paper,wfpg-transient-oriented,wfpg"),
    quality("quality-tiles.json", ("gpu", "scenes"), 15, SMALL,
            "--spp 128 --seeds 32 --reference-spp 2 --methods pt,wfpg,wfpg-product "
            + methods("--device cuda", {"wfpg-cuda": "--method wfpg", "wfpg-product-cuda": "--method wfpg-product"})),
    quality("quality-tiles-pt.json", ("gpu", "scenes"), 5, SMALL,
            '--spp 128 --seeds 32 --reference-spp 2 --methods pt --method "pt-cuda=--method pt --device cuda --seed 1000"'),
    quality("quality-last-depth.json", ("gpu", "scenes"), 5, LITERATURE,
            "--spp 256 --seeds 3 --reference-spp 8192 --reference-chunk 4096 --methods pt,wfpg "
            + methods("--method wfpg", {f"depths-{n}": f"--guided-depths {n}" for n in (6, 5, 4)})),
    quality("quality-guided-depths.json", ("gpu", "scenes"), 5,
            '"scenes/veach-ajar.glb --size 320x180" "scenes/bathroom.glb --size 240x240"',
            "--spp 256 --seeds 2 --reference-spp 8192 --reference-chunk 4096 --methods pt,wfpg "
            + methods("--method wfpg", {f"depths-{n}": f"--guided-depths {n}" for n in (1, 2, 3)})),
)
