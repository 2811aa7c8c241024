"""Error and time by number of particles, points, iterations and views."""

from dataclasses import replace

from benchmarks.hybrid.accuracy import SEVEN
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import Summary, summary
from benchmarks.hybrid.plots import Panel, Series, panels
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Section, Table

RINGS = {
    2: (1, 3), 3: (1, 3, 5), 4: (1, 3, 5, 7), 5: (1, 2, 4, 5, 7), 6: (1, 2, 3, 4, 5, 6), 7: (1, 2, 3, 4, 5, 6, 7)
}  # fmt: skip
COUNTS = {
    "particles": (1, 5, 10, 20, 40, 80, 160),
    "points": (100, 200, 400, 800, 1600),
    "iterations": (1, 2, 3, 4, 6, 8),
    "views": tuple(RINGS),
}
TOP_MM = 120.0
Summaries = dict[tuple[str, str, int], Summary]


def scaling(bench: Bench) -> Section:
    wanted = {
        (what, clip, count): _case(Case(clip, prior=KINDS[clip]), what, count)
        for what, counts in COUNTS.items() for clip in SEVEN for count in counts
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (f"{what} {count}", clip, one.mean.mean, one.mean.worst, one.rmse.mean, one.rmse.worst, one.shape.mean,
         one.shape.worst, one.lost.mean, one.losses, one.cpu_ms)
        for (what, clip, count), one in found.items()
    )  # fmt: skip
    errors = [
        Panel(
            "",
            what,
            "mean error, mm",
            tuple(_series(found, what, clip, "error") for clip in SEVEN),
            log=what != "views",
            top=_top([found[what, clip, count].mean.worst for clip in SEVEN for count in counts]),
        )
        for what, counts in COUNTS.items()
    ]
    times = [
        Panel("", what, "ms a frame", tuple(_series(found, what, clip, "time") for clip in SEVEN), log=what != "views")
        for what in COUNTS
    ]
    panels(bench.places.out / "scaling-error.png", "Mean error (filled: up to the worst seed)", errors, 2)
    panels(bench.places.out / "scaling-time.png", "Processor time, one core, median of a frame", times, 2)
    return Section(
        "scaling",
        "Particles, points, iterations, views",
        (
            f"{bench.seeds} seeds; one setting varies, the others are 40 particles, 400 points, 4 iterations, 7 views, the "
            "shipped prior of the kind.  Time: of the processor, one core, median of a frame, silhouettes to pose.",
        ),
        (
            Table(
                "Error and time",
                (
                    "what",
                    "clip",
                    "mean mm",
                    "worst",
                    "RMSE mm",
                    "worst",
                    "shape mm",
                    "worst",
                    "lost %",
                    "losses",
                    "ms a frame",
                ),
                rows,
            ),
        ),
        ("scaling-error.png", "scaling-time.png"),
    )


def _case(case: Case, what: str, count: int) -> Case:
    match what:
        case "views":
            return case if count == len(RINGS[7]) else replace(case, views=tuple(f"cam{k:02d}" for k in RINGS[count]))
        case "particles":
            return replace(case, particles=count)
        case "points":
            return replace(case, points=count)
        case _:
            return replace(case, iterations=count)


def _series(found: Summaries, what: str, clip: str, kind: str) -> Series:
    summaries = [found[what, clip, count] for count in COUNTS[what]]
    x = tuple(map(float, COUNTS[what]))
    if kind == "time":
        return Series(clip, x, tuple(one.cpu_ms for one in summaries))
    return Series(clip, x, tuple(one.mean.mean for one in summaries), tuple(one.mean.worst for one in summaries))


def _top(values: list[float]) -> float | None:
    """Limit of an axis, or None to show everything."""
    return TOP_MM if max(values) > TOP_MM else None
