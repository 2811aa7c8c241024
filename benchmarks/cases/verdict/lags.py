"""Lags that the verdict states, where the silhouettes of one view are stamped late or early."""

import msgspec

from benchmarks.cases.verdict.faults import FAULTS
from benchmarks.cases.verdict.takes import FPS, MOTIONS, FaultyTake, taken, trials
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import motion_file
from zenocap.common import messages as m
from zenocap.tools.judge.evidence import TakeEvidence, evidence_of
from zenocap.tools.judge.view_lag import view_lags

SHIFTS_S = (0.0, 0.2, -0.5, 1.0)
RIGHT_S = 0.5 / FPS


def shifted(take: FaultyTake, view: str, shift_s: float) -> TakeEvidence:
    """TakeEvidence of a take in which one view's video began `shift_s` later than its times say."""
    shift_ns = round(1e9 * shift_s)
    return evidence_of(
        msgspec.structs.replace(one, captured_ns=one.captured_ns - shift_ns)
        if isinstance(one, m.Silhouette) and one.viewer == view
        else one
        for one in take.messages
    )


def run(one: Case) -> Figures:
    """Lags of the take of one shot.  Options: shift, seconds."""
    plain = [trial for trial in trials() if trial.fault == next(iter(FAULTS))]
    take, shift_s = taken(plain[one.seed]), one.option("shift", 0.0)
    views = sorted({each.viewer for each in take.messages if isinstance(each, m.CameraInfo)})
    view = views[1 + one.seed % (len(views) - 1)]  # every take has another late one
    found = view_lags(shifted(take, view, shift_s))
    if found is None:
        return {"not stated": 1}
    right = list(found.views) == [view] and abs(found.views[view] - shift_s) <= RIGHT_S and shift_s != 0.0
    return {"right": 1, "error": 1000 * abs(found.views[view] - shift_s)} if right else {"wrong": 1}


LAGS = Kind(
    "verdict-lags",
    "Takes of simulated people without a fault in which one view is stamped wrongly, two and four views: lags that the "
    "verdict states.",
    run,
    (
        *(Quantity(name, "takes", 0, joined="sum") for name in ("right", "wrong", "not stated")),
        Quantity("error", "ms", 0, joined="median"),
    ),
    {f"{shift:+.1f} s": case("plain", shift=shift) for shift in SHIFTS_S},
    case("plain", shift=1.0),
    seeds=28,
    rows="lag",
    inputs=lambda _: tuple(map(motion_file, MOTIONS)),
)
