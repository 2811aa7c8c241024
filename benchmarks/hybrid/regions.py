"""Error by the number of regions M of the prior.  [Hybrid Fig. 8]"""

from benchmarks.hybrid.accuracy import SEVEN, VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import summary
from benchmarks.hybrid.plots import Panel, Series, panels
from benchmarks.hybrid.priors import KINDS, another_take
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Section, Table

COUNTS = (5, 10, 20, 40, 80)
VARIANTS: dict[str, tuple[str, float | None]] = {
    "7 views": ("7", None),
    "3 views": ("3", None),
    "7 views, prior alone": ("7", 1.0),
}


def regions(bench: Bench) -> Section:
    training_sources = {clip: [f"actor:{KINDS[clip]}"] for clip in SEVEN}
    for clip in SEVEN:
        training_sources[clip] += [another for another in [another_take(clip, bench.clip(clip).motion)] if another]
    wanted = {
        (clip, source, variant, count): Case(clip, views=VIEWS[number], prior=f"{source}@{count}", share=share)
        for clip in SEVEN for source in training_sources[clip]
        for variant, (number, share) in VARIANTS.items() for count in COUNTS
    }  # fmt: skip
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (clip, source.split(":")[0], variant, count, one.mean.mean, one.mean.worst, one.rmse.mean, one.rmse.worst,
         one.shape.mean, one.losses)
        for (clip, source, variant, count), one in found.items()
    )  # fmt: skip
    variant_panels = [
        Panel(
            variant, "regions M", "RMSE, mm",
            tuple(
                Series(
                    f"{clip}, {source.split(':')[0]}", tuple(map(float, COUNTS)),
                    tuple(found[clip, source, variant, count].rmse.mean for count in COUNTS),
                    tuple(found[clip, source, variant, count].rmse.worst for count in COUNTS),
                )
                for clip in SEVEN for source in training_sources[clip]
            ),
            log=True,
        )
        for variant in VARIANTS
    ]  # fmt: skip
    panels(bench.places.out / "regions.png", "RMSE by the prior's regions (filled: up to the worst seed)", variant_panels)
    return Section(
        "regions",
        "Regions of the prior (Fig. 8)",
        (
            f"{bench.seeds} seeds.  Trained with exactly M regions: on the simulated person, and for `walk7` also on other "
            "walks of motion capture.  Prior alone: every proposal but the first comes from the prior, as in the paper; "
            "otherwise its share adapts.",
        ),
        (
            Table(
                "Error by number of regions",
                ("clip", "trained on", "variant", "M", "mean mm", "worst", "RMSE mm", "worst", "shape mm", "losses"),
                rows,
            ),
        ),
        ("regions.png",),
    )
