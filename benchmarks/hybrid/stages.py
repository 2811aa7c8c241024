"""Time per frame by stage, with one and two cores, and of a start, cold and warm."""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np

from benchmarks.hybrid.accuracy import VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.plots import stacked
from benchmarks.sections import Section, Table

CLIPS = ("walk7", "box7")
NUMBERS = ("7", "4")
THREADS = (1, 2)
ROUNDS = 3
STARTS = 3
AIMS_MS = {1: 12.0, 2: 8.0}  # whole frame at seven views, by threads
WHOLE = "whole"


class Timed(msgspec.Struct, frozen=True):
    """Output of `stage_times`: seconds of a start; milliseconds by stage over frames."""

    imported_s: float
    ready_s: float
    load: float
    median_ms: dict[str, float] = {}
    p99_ms: dict[str, float] = {}


def stages(bench: Bench) -> Section:
    for clip in CLIPS:
        bench.clip(clip)  # computes the silhouettes before the timing
    outputs = {
        (clip, number, threads): [_measured(bench, clip, number, threads) for _ in range(ROUNDS)]
        for clip in CLIPS for number in NUMBERS for threads in THREADS
    }  # fmt: skip
    names = list(outputs[CLIPS[0], NUMBERS[0], 1][0].median_ms)
    medians = {
        run: {name: _median([one.median_ms[name] for one in runs]) for name in names} for run, runs in outputs.items()
    }
    rows = tuple(
        (_title(run), *medians[run].values(), _median([one.p99_ms[WHOLE] for one in runs]),
         AIMS_MS[run[2]] if run[1] == "7" else "", _load(runs))
        for run, runs in outputs.items()
    )  # fmt: skip
    parts = {name: [medians[run][name] for run in outputs] for name in names if name != WHOLE}
    stacked(
        bench.places.out / "stages.png",
        "Time per frame by stage (medians), silhouettes to pose",
        "ms", [_title(run) for run in outputs], parts,
        {f"aim at 7 views, {n} core{'s' if n > 1 else ''}": aim for n, aim in AIMS_MS.items()},
        [medians[run][WHOLE] for run in outputs],
    )  # fmt: skip
    return Section(
        "stages",
        "Time per frame by stage; cold and warm start",
        (
            f"Median over frames of motion, then over {ROUNDS} runs; 40 particles, 400 points, 4 iterations, shipped "
            "prior.  "
            f"{os.cpu_count()} cores, shared with other programs: the load average (1 minute) is listed.",
            "Start: a fresh process, from its first line until it can track; cold: without cached compiled code.",
        ),
        (
            Table("Time per frame by stage, ms", ("run", *names, "p99 whole", "aim whole", "load"), rows),
            _starts(bench),
        ),
        ("stages.png",),
    )


def _starts(bench: Bench) -> Table:
    rows = []
    with TemporaryDirectory() as cache:
        for name, folders in (
            ("cold", [Path(cache) / str(k) for k in range(STARTS)]),
            ("warm", [Path(cache) / "0"] * STARTS),
        ):
            runs = [_measured(bench, CLIPS[0], "7", 2, folder) for folder in folders]
            imported, ready = [one.imported_s for one in runs], [one.ready_s for one in runs]
            both = [a + b for a, b in zip(imported, ready, strict=True)]
            rows.append((name, STARTS, _median(imported), _median(ready), _median(both), max(both), _load(runs)))
    return Table("Start, seconds", ("start", "runs", "imports", "ready", "both", "worst", "load"), tuple(rows))


def _measured(bench: Bench, clip: str, number: str, threads: int, cache: Path | None = None) -> Timed:
    """Output of `stage_times`.  cache: of compiled code; with it only the start is timed."""
    places = [str(bench.places.clips), str(bench.places.out)]
    command = [sys.executable, "-m", "benchmarks.hybrid.stage_times", *places, clip, ",".join(VIEWS[number]) or "all"]
    start_options = [] if cache is None else ["--start-only"]
    environment = os.environ | ({} if cache is None else {"ZENOCAP_CACHE": str(cache)})
    done = subprocess.run([*command, str(threads), *start_options], capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise RuntimeError(f"stage_times {clip} {number}: {done.stderr.strip()}")
    return msgspec.json.decode(done.stdout.splitlines()[-1], type=Timed)


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _load(runs: list[Timed]) -> float:
    return _median([one.load for one in runs])


def _title(run: tuple[str, str, int]) -> str:
    clip, number, threads = run
    return f"{clip}, {number} views, {threads} core{'s' if threads > 1 else ''}"
