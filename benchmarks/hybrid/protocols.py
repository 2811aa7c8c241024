"""Training data of the prior: none, the simulated person, another take, the first frames of the same take."""

from benchmarks.hybrid.accuracy import SEVEN, TWO, VIEWS
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import COLUMNS, Summary, summary
from benchmarks.hybrid.plots import bars
from benchmarks.hybrid.priors import KINDS, TAKE_FRAMES, another_take, training_frames
from benchmarks.hybrid.runs import Case
from benchmarks.sections import Section, Table

NUMBERS = ("7", "3")
NONE, SHIPPED, ANOTHER, SAME = "none", "shipped", "another take", "same take"


def protocols(bench: Bench) -> Section:
    wanted: dict[tuple[str, str, str], Case] = {}
    for clip in SEVEN:
        skipped = training_frames(_motion_frames(bench, clip))
        for number in NUMBERS:
            for protocol, prior in _priors(bench, clip).items():
                wanted[clip, number, protocol] = Case(clip, views=VIEWS[number], prior=prior, skipped=skipped)
    for clip in TWO:
        for protocol, prior in _priors(bench, clip).items():
            if protocol != SAME:  # they have fewer frames of motion than the training needs
                wanted[clip, "2", protocol] = Case(clip, prior=prior)
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (f"{clip}, {number} views", protocol, wanted[clip, number, protocol].prior or "none", *one.cells())
        for (clip, number, protocol), one in found.items()
    )
    groups = list(dict.fromkeys((clip, number) for clip, number, _ in found))
    missing = Summary.missing()
    by_protocol = {p: [found.get((*group, p), missing) for group in groups] for p in (NONE, SHIPPED, ANOTHER, SAME)}
    bars(
        bench.places.out / "protocols.png",
        "Mean error by training data of the prior (whiskers: worst seed)",
        "mean error, mm",
        [f"{clip}\n{number} views" for clip, number in groups],
        {name: [one.mean.mean for one in figures] for name, figures in by_protocol.items()},
        {name: [one.mean.worst for one in figures] for name, figures in by_protocol.items()},
    )
    return Section(
        "protocols",
        "Training data of the prior",
        (
            f"{bench.seeds} seeds.  The same take: the first {TAKE_FRAMES} frames of motion of the clip's truth, as in the "
            f"paper, or half of a shorter one; all protocols of `walk7`, `jog7` and `box7` are scored on the later "
            "frames.  Another take: motion capture of the same kind that did not drive the clip (walks 02_02 and 07_01 to "
            "07_06; kick 10_01).  There is no other take of running, boxing and bending, hence no such row.",
            "Shipped: trained on the simulated person only.",
        ),
        (Table("Error by training protocol", ("clip", "protocol", "prior", *COLUMNS), rows),),
        ("protocols.png",),
    )


def _priors(bench: Bench, clip: str) -> dict[str, str]:
    found = {NONE: "", SHIPPED: KINDS[clip]}
    another = another_take(clip, bench.clip(clip).motion)
    return (
        found
        | ({ANOTHER: another} if another else {})
        | {SAME: f"take:{clip}/{training_frames(_motion_frames(bench, clip))}"}
    )


def _motion_frames(bench: Bench, name: str) -> int:
    clip = bench.clip(name)
    return int((clip.truth.frames >= clip.motion_from).sum())
