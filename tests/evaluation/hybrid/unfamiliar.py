"""Motion that the prior has never seen: a walking prior while the person boxes."""

from tests.evaluation.hybrid.accuracy import VIEWS
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.figures import COLUMNS, summary
from tests.evaluation.hybrid.plots import bars
from tests.evaluation.hybrid.runs import Case
from tests.evaluation.sections import Section, Table

CLIP = "box7"
PRIORS = ("", "boxing", "general", "walking")
SHARES: dict[str, float | None] = {"adaptive": None, "half": 0.5, "prior alone": 1.0}
NUMBERS = ("7", "4", "3")
CUT_MM = 150.0


def unfamiliar(bench: Bench) -> Section:
    wanted = {
        (number, prior, way): Case(CLIP, views=VIEWS[number], prior=prior, share=share)
        for number in NUMBERS for prior in PRIORS for way, share in SHARES.items() if prior or share is None
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    kinds = list(dict.fromkeys((prior, way) for _, prior, way in found))
    series = {
        f"{prior}, {way}" if prior else "no prior": [found[n, prior, way].mean for n in NUMBERS] for prior, way in kinds
    }
    bars(
        bench.places.out / "unfamiliar.png",
        f"{CLIP}: mean error by prior and its share (whiskers: worst seed; cut off at {CUT_MM:g} mm)",
        "mean error, mm",
        [f"{number} views" for number in NUMBERS],
        {name: [one.mean for one in some] for name, some in series.items()},
        {name: [one.worst for one in some] for name, some in series.items()},
        CUT_MM,
    )
    rows = tuple(
        (f"{number} views", prior or "none", way if prior else "", *one.cells())
        for (number, prior, way), one in found.items()
    )
    return Section(
        "unfamiliar",
        "Unfamiliar motion",
        (
            f"{bench.seeds} seeds of `{CLIP}`.  Share of the proposals that come from the prior: adaptive as shipped, held "
            "at a half, or all but the first particle.",
        ),
        (Table(f"{CLIP} by prior and its share", ("views", "prior", "share", *COLUMNS), rows),),
        ("unfamiliar.png",),
    )
