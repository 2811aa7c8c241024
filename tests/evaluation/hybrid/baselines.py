"""The hybrid tracker beside the image force alone and a particle filter in the full space.  [Hybrid Table II]"""

from common.runtime.tracker_table import ITERATIONS, PARTICLES
from services.tracker.phases import Method, Refinement
from tests.evaluation.hybrid.accuracy import SEVEN, VIEWS
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.figures import Summary, summary
from tests.evaluation.hybrid.plots import bars
from tests.evaluation.hybrid.priors import KINDS
from tests.evaluation.hybrid.runs import Case
from tests.evaluation.sections import Section, Table

NUMBERS = ("7", "3")
KINDS_OF: tuple[tuple[Method, Refinement], ...] = (
    ("hybrid", "gauss-newton"),
    ("hybrid", "force"),
    ("image-force", "gauss-newton"),
    ("image-force", "force"),
    ("image-force", "force-printed"),
    ("particle-filter", "gauss-newton"),
)
SLOW = ("hybrid", "force")  # with seven views only
PAPER = {
    "hybrid": (8.57, 16.77, 30.75),
    "image-force": (13.56, 666.56, 587.75),
    "particle-filter": (32.45, 48.82, 137.69),
}
PAPER_S = {"hybrid": (15, 14, 17), "image-force": (3, 2, 2), "particle-filter": (250, 256, 271)}
CUT_MM = 160.0


def baselines(bench: Bench) -> Section:
    groups = [(clip, number) for number in NUMBERS for clip in SEVEN]
    wanted = {
        (method, refinement, clip, number): Case(
            clip, views=VIEWS[number], prior=KINDS[clip] if method == "hybrid" else "", method=method,
            particles=PARTICLES[method], refinement=refinement, iterations=ITERATIONS[refinement],
        )
        for method, refinement in KINDS_OF for clip, number in groups
        if (method, refinement) != SLOW or number == NUMBERS[0]
    }  # fmt: skip
    runs = bench.runs([case for case in wanted.values() if case.particles > 1])
    runs |= bench.runs([case for case in wanted.values() if case.particles == 1], seeds=1)
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (_name(method, refinement), f"{clip}, {number} views", PARTICLES[method], ITERATIONS[refinement], one.seeds,
         one.rmse.mean, one.rmse.worst, one.mean.mean, one.shape.mean, one.lost.mean, one.losses, one.cpu_ms,
         PAPER[method][SEVEN.index(clip)] if number == "7" else "",
         PAPER_S[method][SEVEN.index(clip)] if number == "7" else "")
        for (method, refinement, clip, number), one in found.items()
    )  # fmt: skip
    missing = Summary.missing()
    each = {_name(*kind): [found.get((*kind, *group), missing).rmse for group in groups] for kind in KINDS_OF}
    means = {name: [one.mean for one in some] for name, some in each.items()}
    worst = {name: [one.worst for one in some] for name, some in each.items()}
    bars(
        bench.places.out / "baselines.png",
        f"RMSE by method (whiskers: worst seed; cut off at {CUT_MM:g} mm)",
        "RMSE, mm", [f"{clip}\n{number} views" for clip, number in groups], means, worst, CUT_MM,
    )  # fmt: skip
    return Section(
        "baselines",
        "Methods (Table II)",
        (
            f"{bench.seeds} seeds.  The hybrid tracker has the shipped prior of the kind.  One particle draws nothing: "
            "every seed gives the same.  Time: of the processor, one core, median of a frame, silhouettes to pose.",
        ),
        (
            Table(
                "RMSE, losses and time by method",
                ("method", "clip", "particles", "iterations", "seeds", "RMSE mm", "worst", "mean mm", "shape mm",
                 "lost %", "losses", "ms a frame",
                 "paper's RMSE mm", "paper's s a frame"),
                rows,
            ),
        ),
        ("baselines.png",),
    )  # fmt: skip


def _name(method: Method, refinement: Refinement) -> str:
    return method if method == "particle-filter" else f"{method}, {refinement}"
