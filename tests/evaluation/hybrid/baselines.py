"""The hybrid tracker beside the image force alone and a particle filter in the full space.  [Hybrid Table II]"""

from typing import get_args

from services.tracker.phases import Method, Refinement
from tests.evaluation.hybrid.accuracy import SEVEN, VIEWS
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.figures import Section, Table, summary
from tests.evaluation.hybrid.plots import bars
from tests.evaluation.hybrid.priors import KINDS
from tests.evaluation.hybrid.runs import Case

NUMBERS = ("7", "3")
PARTICLES: dict[Method, int] = {"hybrid": 40, "image-force": 1, "particle-filter": 1000}
PAPER = {
    "hybrid": (8.57, 16.77, 30.75),
    "image-force": (13.56, 666.56, 587.75),
    "particle-filter": (32.45, 48.82, 137.69),
}
PAPER_S = {"hybrid": (15, 14, 17), "image-force": (3, 2, 2), "particle-filter": (250, 256, 271)}
CUT_MM = 160.0


def kinds() -> list[tuple[Method, Refinement]]:
    """Methods with every way to refine that they have."""
    refining: tuple[Method, ...] = ("hybrid", "image-force")
    some: list[tuple[Method, Refinement]] = [
        (method, refinement) for method in refining for refinement in get_args(Refinement)
    ]
    return [*some, ("particle-filter", "gauss-newton")]


def baselines(bench: Bench) -> Section:
    wanted = {
        (method, refinement, clip, number): Case(
            clip, views=VIEWS[number], prior=KINDS[clip] if method == "hybrid" else "", method=method,
            particles=PARTICLES[method], refinement=refinement, iterations=4 if refinement == "gauss-newton" else 16,
        )
        for method, refinement in kinds() for clip in SEVEN for number in NUMBERS
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    rows, groups, means, worst = [], [f"{clip}\n{number} views" for number in NUMBERS for clip in SEVEN], {}, {}
    for method, refinement in kinds():
        name = method if method == "particle-filter" else f"{method}, {refinement}"
        found = [summary(runs[wanted[method, refinement, clip, number]]) for number in NUMBERS for clip in SEVEN]
        means[name], worst[name] = [one.rmse.mean for one in found], [one.rmse.worst for one in found]
        for k, (number, clip) in enumerate((number, clip) for number in NUMBERS for clip in SEVEN):
            one, at = found[k], SEVEN.index(clip)
            rows.append(
                (name, f"{clip}, {number} views", PARTICLES[method], one.rmse.mean, one.rmse.worst, one.mean.mean,
                 one.shape.mean, one.lost.mean, one.losses, one.cpu_ms,
                 PAPER[method][at] if number == "7" else "", PAPER_S[method][at] if number == "7" else "")
            )  # fmt: skip
    bars(
        bench.places.out / "baselines.png",
        f"RMSE by method (whiskers: worst seed; cut off at {CUT_MM:g} mm)",
        "RMSE, mm", groups, means, worst, CUT_MM,
    )  # fmt: skip
    return Section(
        "baselines",
        "Methods (Table II)",
        (
            f"{bench.seeds} seeds.  The hybrid tracker has the shipped prior of the kind.  Force steps: 16 iterations, "
            "Gauss-Newton: 4.  Time: of the processor, one core, median of a frame, silhouettes to pose.",
        ),
        (
            Table(
                "RMSE, losses and time by method",
                ("method", "clip", "particles", "RMSE mm", "worst", "mean mm", "shape mm", "lost %", "losses", "ms a frame",
                 "paper's RMSE mm", "paper's s a frame"),
                tuple(rows),
            ),
        ),
        ("baselines.png",),
    )  # fmt: skip
