"""What the prior was learnt from: nothing, the synthetic actor, another take, the first frames of the same take."""

from tests.evaluation.hybrid.accuracy import SEVEN, TWO, VIEWS
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.figures import COLUMNS, Summary, summary
from tests.evaluation.hybrid.plots import bars
from tests.evaluation.hybrid.priors import KINDS, TAKE_FRAMES, another_take, taken_frames
from tests.evaluation.hybrid.runs import Case
from tests.evaluation.sections import Section, Table

NUMBERS = ("7", "3")
NONE, SHIPPED, ANOTHER, SAME = "none", "shipped", "another take", "same take"


def protocols(bench: Bench) -> Section:
    wanted: dict[tuple[str, str, str], Case] = {}
    for clip in SEVEN:
        skipped = taken_frames(_motion_frames(bench, clip))
        for number in NUMBERS:
            for protocol, prior in _priors(bench, clip).items():
                wanted[clip, number, protocol] = Case(clip, views=VIEWS[number], prior=prior, skipped=skipped)
    for clip in TWO:
        for protocol, prior in _priors(bench, clip).items():
            if protocol != SAME:  # they have fewer frames of motion than are to be learnt from
                wanted[clip, "2", protocol] = Case(clip, prior=prior)
    runs = bench.runs(list(wanted.values()))
    found = {key: summary(runs[case]) for key, case in wanted.items()}
    rows = tuple(
        (f"{clip}, {number} views", protocol, wanted[clip, number, protocol].prior or "none", *one.cells())
        for (clip, number, protocol), one in found.items()
    )
    places = list(dict.fromkeys((clip, number) for clip, number, _ in found))
    missing = Summary.missing()
    each = {p: [found.get((*place, p), missing) for place in places] for p in (NONE, SHIPPED, ANOTHER, SAME)}
    bars(
        bench.places.out / "protocols.png",
        "Mean error by what the prior was learnt from (whiskers: worst seed)",
        "mean error, mm",
        [f"{clip}\n{number} views" for clip, number in places],
        {name: [one.mean.mean for one in some] for name, some in each.items()},
        {name: [one.mean.worst for one in some] for name, some in each.items()},
    )
    return Section(
        "protocols",
        "What the prior was learnt from",
        (
            f"{bench.seeds} seeds.  The same take: the first {TAKE_FRAMES} frames of motion of the clip's truth, as in the "
            f"paper, or half of a shorter one; all protocols of `walk7`, `jog7` and `box7` are scored on the frames after "
            "those.  Another take: "
            "motion capture of the same kind that did not drive the clip (walks 02_02 and 07_01 to 07_06; kick 10_01).  Of "
            "running, boxing and bending there is no other take, so there is no such row: what is shipped stands for it.",
            "Shipped: learnt from the synthetic actor alone.",
        ),
        (Table("Error by training protocol", ("clip", "protocol", "prior", *COLUMNS), rows),),
        ("protocols.png",),
    )


def _priors(bench: Bench, clip: str) -> dict[str, str]:
    found = {NONE: "", SHIPPED: KINDS[clip]}
    another = another_take(clip, bench.clip(clip).motion)
    return (
        found | ({ANOTHER: another} if another else {}) | {SAME: f"take:{clip}/{taken_frames(_motion_frames(bench, clip))}"}
    )


def _motion_frames(bench: Bench, name: str) -> int:
    clip = bench.clip(name)
    return int((clip.truth.frames >= clip.motion_from).sum())
