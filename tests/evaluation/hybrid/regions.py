"""Error by the number of regions M of the prior.  [Hybrid Fig. 8]"""

from tests.evaluation.hybrid.accuracy import SEVEN, VIEWS
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.figures import summary
from tests.evaluation.hybrid.plots import Panel, Series, panels
from tests.evaluation.hybrid.priors import KINDS, another_take
from tests.evaluation.hybrid.runs import Case
from tests.evaluation.sections import Section, Table

COUNTS = (5, 10, 20, 40, 80)
WAYS: dict[str, tuple[str, float | None]] = {
    "7 views": ("7", None),
    "3 views": ("3", None),
    "7 views, prior alone": ("7", 1.0),
}


def regions(bench: Bench) -> Section:
    learnt = {clip: [f"actor:{KINDS[clip]}"] for clip in SEVEN}
    for clip in SEVEN:
        learnt[clip] += [another for another in [another_take(clip, bench.clip(clip).motion)] if another]
    wanted = {
        (clip, source, way, count): Case(clip, views=VIEWS[number], prior=f"{source}@{count}", share=share)
        for clip in SEVEN for source in learnt[clip] for way, (number, share) in WAYS.items() for count in COUNTS
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (clip, source.split(":")[0], way, count, one.mean.mean, one.mean.worst, one.rmse.mean, one.rmse.worst,
         one.shape.mean, one.losses)
        for (clip, source, way, count), one in found.items()
    )  # fmt: skip
    every = [
        Panel(
            way, "regions M", "RMSE, mm",
            tuple(
                Series(
                    f"{clip}, {source.split(':')[0]}", tuple(map(float, COUNTS)),
                    tuple(found[clip, source, way, count].rmse.mean for count in COUNTS),
                    tuple(found[clip, source, way, count].rmse.worst for count in COUNTS),
                )
                for clip in SEVEN for source in learnt[clip]
            ),
            log=True,
        )
        for way in WAYS
    ]  # fmt: skip
    panels(bench.places.out / "regions.png", "RMSE by the prior's regions (filled: up to the worst seed)", every)
    return Section(
        "regions",
        "Regions of the prior (Fig. 8)",
        (
            f"{bench.seeds} seeds.  Learnt with exactly M regions: from the synthetic actor, and for `walk7` from other "
            "walks of motion capture as well.  Prior alone: every proposal but the first comes from it, as in the paper; "
            "otherwise its share adapts.",
        ),
        (
            Table(
                "Error by number of regions",
                ("clip", "learnt from", "way", "M", "mean mm", "worst", "RMSE mm", "worst", "shape mm", "losses"),
                rows,
            ),
        ),
        ("regions.png",),
    )
