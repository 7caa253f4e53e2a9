"""Tables and figures of docs/performance.md and docs/packages.md: times, memory and compile times."""
from typing import Dict, List

from blocks import Results, Rows, block, per_cent, span, three

from stages_plot import waves_of  # bench/stages_plot.py
from table import STAGES, compiler_rows, stage_rows, with_casting  # bench/table.py

EQUAL_TIME, SAMPLES, PROFILE = "cuda-equal-time.json", "cuda-sample-times.json", "cuda-profile.txt"


@block
def equal_time_gpu(results: Results) -> Rows:
    """Errors and gains after as long a time."""
    rows = [["scene", "method", "samples", "MSE after c / (1 + c)", "gain", "gain, relative MSE", "ms a sample"]]
    for scene in results.json(EQUAL_TIME, "scenes"):
        for name, m in scene["methods"].items():
            rows.append([scene["scene"], name, str(m["spp"]), f"{m['mse_reinhard']:.2e}", three(m["ratios"]["mse_reinhard"]),
                         three(m["ratios"]["relmse_trimmed"]), three(m["milliseconds_a_sample"]["total"])])
    return rows


@block
def equal_time_setup(results: Results) -> str:
    """Seconds of renderings and of their references."""
    seconds, reference = (results.json(EQUAL_TIME, key) for key in ("seconds", "reference_seconds"))
    return f"Renderings take {seconds:g} s, and the references {reference:g} s"


@block
def equal_time_gain(results: Results, scene: str, method: str = "wfpg") -> str:
    """A method's gain at equal time on the GPU."""
    methods = next(s["methods"] for s in results.json(EQUAL_TIME, "scenes") if s["scene"] == scene)
    ratio = methods[method]["ratios"]["mse_reinhard"]
    if ratio is None:
        raise ValueError(f"{EQUAL_TIME}: noise of the references hides the error of {method} in {scene}: give them more seconds")
    return f"{ratio:.2g}"


@block
def equal_time_stages(results: Results) -> Rows:
    """Milliseconds of a sample by stage."""
    stages = [s for s in STAGES if s not in ("sort", "update")] + ["update"]
    rows = [["scene", "method", *stages]]
    for scene in results.json(EQUAL_TIME, "scenes"):
        for name, m in scene["methods"].items():
            rows.append([scene["scene"], name, *(three(m["milliseconds_a_sample"].get(s, 0.0)) for s in stages)])
    return rows


@block
def equal_time_sort(results: Results) -> str:
    """Least and most time of sorting a sample's rays."""
    times = [m["milliseconds_a_sample"]["sort"] for s in results.json(EQUAL_TIME, "scenes") for m in s["methods"].values()]
    return span(times, 2) + " ms"


@block
def equal_time_memory(results: Results) -> Rows:
    """MiB that methods keep, and have in flight."""
    scenes = {s["scene"]: s["methods"] for s in results.json(EQUAL_TIME, "scenes")}
    rows = [["MiB", "cornell-enclosed, kept", "in flight", "ajar, kept", "in flight"]]
    for method in ("transient", "wfpg", "product"):
        cells: List[str] = []
        for scene in ("cornell-enclosed", "ajar"):
            m = scenes[scene][method]
            cells += [f"{m['persistent_bytes'] / 2**20:.1f}", f"{m['transient_bytes'] / 2**20:.0f}"]
        rows.append([method, *cells])
    return rows


@block
def sample(results: Results) -> Rows:
    """A sample after warm-up by stage."""
    stages = ("trace", "lights", "directions", "shade")
    scene = results.json(SAMPLES, "settled_samples", 0)
    rows = [[scene["scene"], "million segments", "ms", *stages]]
    for name, ms in scene["milliseconds"].items():
        rows.append([name, three(ms["segments"] * 1e-6), three(ms["total"]), *(three(ms[s]) for s in stages)])
    return rows


@block
def sample_ratio(results: Results, by: str) -> str:
    """Time of a guided sample over path tracing's, `sample` or `segment`."""
    return f"{results.json(SAMPLES, 'settled_samples', 0, f'ratio_a_{by}'):.3f}"


@block
def sample_ms(results: Results, method: str, stage: str) -> str:
    """Milliseconds of a stage of a sample after warm-up."""
    return f"{results.json(SAMPLES, 'settled_samples', 0, 'milliseconds', method, stage):.2f} ms"


@block
def sample_more(results: Results, *stages: str) -> str:
    """Milliseconds that stages of a guided sample take beyond path tracing's."""
    ms = results.json(SAMPLES, "settled_samples", 0, "milliseconds")
    return f"{sum(ms['wfpg'][s] - ms['pt'][s] for s in stages):.2f} ms"


def profiled(results: Results, commit: str) -> Dict[str, float]:
    """A row of the profile: a sample of ajar at a commit, by its subject's first words, or path tracing's."""
    row = results.found(PROFILE, rf'^(?:{commit}|"{commit}.*") +((?:[\d.]+ *)+)$')
    names = ("sample", "segment", "trace", "lights", "directions", "shade")
    return dict(zip(names, map(float, row[1].split())))


@block
def profile_ratio(results: Results, by: str) -> str:
    """Time of a guided sample over path tracing's at the profile's last commit, by `sample` or `segment`."""
    last = profiled(results, "Bound registers")
    return f"{last['segment'] if by == 'segment' else last['sample'] / profiled(results, 'pt')['sample']:.2f}"


@block
def profile_directions(results: Results) -> str:
    """Milliseconds of directions that the profile's last commit has beyond its first."""
    return f"{profiled(results, 'Bound registers')['directions'] - profiled(results, 'Build kept')['directions']:.2f} ms"


@block
def profile_pass(results: Results, what: str) -> str:
    """Of the pass over a wave: its `time`, what it moves in `memory`, or active `warps`."""
    waves = waves_of(results.text(PROFILE))
    if what == "time":
        return span([w.seconds * 1e6 for w in waves], 0) + " µs"
    if what == "memory":
        return span([w.memory * 1e-9 for w in waves], 2) + " GB"
    return f"{100 * max(w.warps for w in waves):.0f}%"


@block
def profile_roof(results: Results, roof: str) -> str:
    """What the pass over a wave reaches of the bandwidth of `memory` or of the rate of `instructions`."""
    return per_cent([wave.part_of(roof) for wave in waves_of(results.text(PROFILE))])


@block
def profile_deposits(results: Results) -> str:
    """Milliseconds of depositing since the table."""
    rows = [results.found(PROFILE, rf"^ +{name} +[\d.]+(?: ms)? +([\d.]+)") for name in ("resolution 128", "resolution 256", "a tenth in one")]
    return "{:.2f}, {:.2f} and {:.2f} ms".format(*(float(row[1]) for row in rows))


@block
def stages(results: Results) -> Rows:
    """Stages on the GPU beside their floors."""
    return stage_rows(with_casting(results.json("cuda-stages.json", "benchmarks"), results.json("cuda-casting.json", "benchmarks")))


@block
def compilers(results: Results) -> Rows:
    """What including the library costs a compiler."""
    return compiler_rows(results.json("compile-time.json", "compilers"))


@block
def compile_ratios(results: Results, source: str) -> str:
    """A source's compile times over those of Thrust and GLM, by compiler."""
    return span([sources[source]["ratio"] for sources in results.json("compile-time.json", "compilers").values()])
