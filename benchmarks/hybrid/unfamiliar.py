"""Motion unlike the prior's training: a walking prior while the person boxes."""

from benchmarks.hybrid.accuracy import VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import COLUMNS, summary
from benchmarks.hybrid.plots import bars
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Section, Table

CLIP = "box7"
PRIORS = ("", "boxing", "general", "walking")
SHARES: dict[str, float | None] = {"adaptive": None, "half": 0.5, "prior alone": 1.0}
NUMBERS = ("7", "4", "3")
CUT_MM = 150.0


def unfamiliar(bench: Bench) -> Section:
    wanted = {
        (number, prior, share_name): Case(CLIP, views=VIEWS[number], prior=prior, share=share)
        for number in NUMBERS for prior in PRIORS for share_name, share in SHARES.items() if prior or share is None
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    kinds = list(dict.fromkeys((prior, share_name) for _, prior, share_name in found))
    series = {
        f"{prior}, {share_name}" if prior else "no prior": [found[n, prior, share_name].mean for n in NUMBERS]
        for prior, share_name in kinds
    }
    bars(
        bench.places.out / "unfamiliar.png",
        f"{CLIP}: mean error by prior and its share (whiskers: worst seed; cut off at {CUT_MM:g} mm)",
        "mean error, mm",
        [f"{number} views" for number in NUMBERS],
        {name: [one.mean for one in figures] for name, figures in series.items()},
        {name: [one.worst for one in figures] for name, figures in series.items()},
        CUT_MM,
    )
    rows = tuple(
        (f"{number} views", prior or "none", share_name if prior else "", *one.cells())
        for (number, prior, share_name), one in found.items()
    )
    return Section(
        "unfamiliar",
        "Unfamiliar motion",
        (
            f"{bench.seeds} seeds of `{CLIP}`.  Share of the proposals that come from the prior: adaptive (default), fixed "
            "at one half, or all but the first particle.",
        ),
        (Table(f"{CLIP} by prior and its share", ("views", "prior", "share", *COLUMNS), rows),),
        ("unfamiliar.png",),
    )
