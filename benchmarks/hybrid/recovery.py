"""Ten empty frames in the middle: number of frames until the person is tracked again."""

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.hybrid.accuracy import SEVEN, VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import frames_until
from benchmarks.hybrid.plots import Panel, Series, panels
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import Case, Run
from benchmarks.sections import Section, Table
from zenocap.common.arrays import Floats

EMPTY = 10
GAPS = 5
RECOVERED_MM = 50.0
NUMBERS = ("7", "4")
SHOWN = 40  # frames after the empty ones


def recovery(bench: Bench) -> Section:
    selected = {
        (clip, number, frame): Case(clip, views=VIEWS[number], prior=KINDS[clip], empty_from=frame, empty_frames=EMPTY)
        for clip in SEVEN for number in NUMBERS for frame in gap_starts(bench, clip)
    }  # fmt: skip
    runs = bench.runs(list(selected.values()))
    rows, each = [], []
    for clip in SEVEN:
        for number in NUMBERS:
            by_frame = {frame: runs[selected[clip, number, frame]] for frame in gap_starts(bench, clip)}
            waits = {frame: [_frames(run, frame) for run in seed_runs] for frame, seed_runs in by_frame.items()}
            every = [wait for some in waits.values() for wait in some]
            known = [wait for wait in every if wait is not None]
            never = len(every) - len(known)
            within = float(np.mean([wait is not None and wait <= 5 for wait in every]) * 100)
            rows.append(
                (f"{clip}, {number} views", len(every), float(np.median(known)) if known else float("nan"),
                 float(np.mean(known)) if known else float("nan"), max(known, default=0), within, never)
            )  # fmt: skip
            each += [
                (f"{clip}, {number} views, from frame {frame}", *("never" if wait is None else wait for wait in some))
                for frame, some in waits.items()
            ]
    _draw(bench, selected, runs)
    return Section(
        "recovery",
        "Ten empty frames",
        (
            f"{bench.seeds} seeds at {GAPS} places of every clip: no view sees anything for {EMPTY} frames.  Frames from "
            f"the first one in which the person is seen until the mean error is below {RECOVERED_MM:g} mm; 1: in that "
            "frame.",
        ),
        (
            Table(
                f"Frames until below {RECOVERED_MM:g} mm",
                ("clip", "runs", "median", "mean", "worst", "% within 5", "never"),
                tuple(rows),
            ),
            Table("The same by place and seed", ("place", *(f"seed {k}" for k in range(bench.seeds))), tuple(each)),
        ),
        ("recovery.png",),
    )


def gap_starts(bench: Bench, clip: str) -> list[int]:
    """First empty frames, evenly over the motion."""
    found = bench.clip(clip)
    last = int(found.truth.frames[-1])
    return [round(frame) for frame in np.linspace(found.motion_from, last, GAPS + 2)[1:-1]]


def _frames(run: Run, frame: int) -> int | None:
    """Number of frames until the person is tracked again after a gap that begins at `frame`."""
    return frames_until(run, frame + EMPTY, RECOVERED_MM)


def _draw(bench: Bench, selected: dict[tuple[str, str, int], Case], runs: dict[Case, list[Run]]) -> None:
    every = []
    for number in NUMBERS:
        for clip in SEVEN:
            series = []
            for frame in gap_starts(bench, clip):
                curves = np.array([_after(run, frame + EMPTY) for run in runs[selected[clip, number, frame]]])
                series.append(
                    Series(f"from {frame}", tuple(map(float, range(1, SHOWN + 1))), tuple(_columns(curves, np.mean)),
                           tuple(_columns(curves, np.max)))
                )  # fmt: skip
            every.append(
                Panel(
                    f"{clip}, {number} views", "frames after", "mean error, mm", tuple(series), aim=RECOVERED_MM, top=200.0
                )
            )
    panels(bench.places.out / "recovery.png", f"After {EMPTY} empty frames (filled: up to the worst seed)", every)


def _after(run: Run, seen: int) -> list[float]:
    errors = list(run.errors[seen - run.first : seen - run.first + SHOWN])
    return errors + [float("nan")] * (SHOWN - len(errors))


def _columns(curves: Floats, what: Callable[[Floats], float]) -> Sequence[float]:
    return [float(what(column[np.isfinite(column)])) if np.isfinite(column).any() else float("nan") for column in curves.T]
