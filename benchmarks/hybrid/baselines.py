"""Hybrid tracker, image force and particle filter with every refinement, seven and three views.  [Hybrid VII]

`table_2` compares the presets' own refinements on the test frames.
"""

from benchmarks.hybrid.accuracy import SEVEN, VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.experiments import PAPER_RMSE_MM, PAPER_S
from benchmarks.hybrid.figures import Summary, summary
from benchmarks.hybrid.plots import bars
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Section, Table
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES
from zenocap.services.tracker.filter.particles import Refinement
from zenocap.services.tracker.states import Method
from zenocap.tools.dataset.build_priors import PAPER as PAPER_PRIOR

NUMBERS = ("7", "3")
METHODS: tuple[tuple[str, Method, Refinement], ...] = (
    ("default", "hybrid", "gauss-newton"),
    ("default", "hybrid", "force"),
    ("default", "image-force", "gauss-newton"),
    ("default", "image-force", "force"),
    ("default", "image-force", "force-printed"),
    ("default", "particle-filter", "gauss-newton"),
    ("paper", "hybrid", "force-printed"),
    ("paper", "image-force", "force-printed"),
    ("paper", "particle-filter", "force-printed"),
)
SLOW = (("default", "hybrid", "force"), ("paper", "hybrid", "force-printed"))  # with seven views only
CUT_MM = 160.0


def baselines(bench: Bench) -> Section:
    groups = [(clip, number) for number in NUMBERS for clip in SEVEN]
    wanted = {
        (preset, method, refinement, clip, number): Case(
            clip, views=VIEWS[number], prior=_prior(preset, method, clip), method=method,
            particles=PARTICLES[method], refinement=refinement, iterations=ITERATIONS[refinement], preset=preset,
        )
        for preset, method, refinement in METHODS for clip, number in groups
        if (preset, method, refinement) not in SLOW or number == NUMBERS[0]
    }  # fmt: skip
    runs = bench.runs([case for case in wanted.values() if case.particles > 1])
    runs |= bench.runs([case for case in wanted.values() if case.particles == 1], seeds=1)
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (preset, _name(method, refinement), f"{clip}, {number} views", PARTICLES[method], ITERATIONS[refinement], one.seeds,
         one.rmse.mean, one.rmse.worst, one.mean.mean, one.shape.mean, one.lost.mean, one.losses, one.cpu_ms,
         PAPER_RMSE_MM[method][SEVEN.index(clip)] if number == "7" else "",
         PAPER_S[method][SEVEN.index(clip)] if number == "7" else "")
        for (preset, method, refinement, clip, number), one in found.items()
    )  # fmt: skip
    missing = Summary.missing()
    each = {
        f"{kind[0]}: {_name(*kind[1:])}": [found.get((*kind, *group), missing).rmse for group in groups] for kind in METHODS
    }
    means = {name: [one.mean for one in figures] for name, figures in each.items()}
    worst = {name: [one.worst for one in figures] for name, figures in each.items()}
    bars(
        bench.places.out / "baselines.png",
        f"RMSE by preset and method (whiskers: worst seed; cut off at {CUT_MM:g} mm)",
        "RMSE, mm", [f"{clip}\n{number} views" for clip, number in groups], means, worst, CUT_MM,
    )  # fmt: skip
    return Section(
        "baselines",
        "Methods and refinements",
        (
            f"{bench.seeds} seeds.  The hybrid tracker uses the shipped prior of the kind.  With one particle nothing is "
            "random: every seed gives the same result.  Time: processor time, one core, median of a frame, silhouettes to "
            "pose.  Preset paper: ten parts, printed likelihood and forces with their errors corrected, all proposals "
            "but one from a prior of 20 regions, no relocalization: a person who is lost stays lost.",
        ),
        (
            Table(
                "RMSE, losses and time by preset and method",
                ("preset", "method", "clip", "particles", "iterations", "seeds", "RMSE mm", "worst", "mean mm", "shape mm",
                 "lost %", "losses", "ms a frame",
                 "paper's RMSE mm", "paper's s a frame"),
                rows,
            ),
        ),
        ("baselines.png",),
    )  # fmt: skip


def _prior(preset: str, method: Method, clip: str) -> str:
    if method != "hybrid":
        return ""
    return KINDS[clip] + (PAPER_PRIOR if preset == "paper" else "")


def _name(method: Method, refinement: Refinement) -> str:
    return method if method == "particle-filter" else f"{method}, {refinement}"
