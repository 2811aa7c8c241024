"""Hybrid tracker, image force and particle filter under both presets on the test frames.  [Hybrid Table II]"""

import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import (
    MOTIONS,
    PAPER_RMSE_MM,
    PAPER_S,
    ProtocolErrors,
    errors_of,
    first_test_frame,
    method_cases,
    runs_of,
)
from benchmarks.hybrid.figures import figure, with_worst
from benchmarks.hybrid.runs import Case, Run
from benchmarks.sections import Cell, Row, Section, Table
from zenocap.services.tracker.states import Method


def table_2(bench: Bench) -> Section:
    wanted = method_cases(bench)
    runs = runs_of(bench, list(wanted.values()))
    clips = {clip: bench.clip(clip) for clip in MOTIONS}
    found = {
        key: errors_of(clips[key[2]].truth, first_test_frame(clips[key[2]]), runs[case]) for key, case in wanted.items()
    }
    kinds = list(dict.fromkeys(key[:2] for key in wanted))
    errors: list[Row] = []
    times: list[Row] = []
    for preset, method in kinds:
        cases = {clip: wanted[preset, method, clip] for clip in MOTIONS}
        first = next(iter(cases.values()))
        each = {clip: found[preset, method, clip] for clip in MOTIONS}
        errors.append((preset, method, first.particles, *_errors(method, each)))
        refinement = "none" if method == "particle-filter" else f"{first.refinement}, {first.iterations}"
        times.append((preset, method, refinement, *_times(method, cases, runs)))
    motions = tuple(cell for motion in MOTIONS.values() for cell in (motion, "paper"))
    return Section(
        "table-2",
        "Methods under both presets (Table II)",
        (
            f"{bench.seeds} seeds, the worst in brackets; one run with one particle, where nothing is random.  Seven "
            "views; test frames and priors of the same take as in Table I.  Preset paper: ten parts, printed distance and "
            "force, no velocity prediction, no relocalization.  The particle filter has no refinement.",
        ),
        (
            Table(
                "RMSE on the test frames, mm", ("preset", "method", "particles", *motions, "lost %: w, j, b"), tuple(errors)
            ),
            Table(
                "Processor time of a frame on one core, ms; the paper's in seconds",
                ("preset", "method", "refinement, iterations", *motions),
                tuple(times),
            ),
        ),
    )


def _errors(method: Method, each: dict[str, ProtocolErrors]) -> tuple[Cell, ...]:
    """Ours and the paper's RMSE by motion, and the lost joints of all motions."""
    cells = [
        cell for k, one in enumerate(each.values()) for cell in (with_worst(one.rmse), f"{PAPER_RMSE_MM[method][k]:.1f}")
    ]
    lost = ", ".join(f"{one.lost.mean:.1f}" if np.isfinite(one.lost.mean) else "–" for one in each.values())
    return *cells, lost


def _times(method: Method, cases: dict[str, Case], runs: dict[Case, list[Run]]) -> tuple[Cell, ...]:
    """Ours and the paper's time by motion."""
    return tuple(
        cell
        for k, case in enumerate(cases.values())
        for cell in (figure([run.cpu_ms for run in runs[case]]).mean, f"{PAPER_S[method][k]} s")
    )
