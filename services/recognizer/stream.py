"""Postures in a stream of feature vectors: irregular in time, with gaps, of any rate; answers soon after each has ended.

The vectors are brought to the model's rate along straight lines, row k at `origin_ns` and k periods, so that what is said
depends on the vectors and their times alone.  `spotting` finds postures among the rows; what moves and is none of them
is told too (`moving`).  A gap of more than MAX_GAP_S ends what went before; nothing is made up across it.
"""

from dataclasses import dataclass, replace

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.features import KINDS, Kind
from services.recognizer.model import Judgement, PostureModel, judge, symbols_of, whiten
from services.recognizer.moving import SHARE, Moving, Stretch, moved
from services.recognizer.spotting import (
    STRICTNESS,
    Hypotheses,
    Spotting,
    Window,
    carried_on,
    hypotheses_of,
    pending,
    settled,
    spotting_of,
)

MAX_GAP_S = 0.5  # a live rig may drop some frames in a row
LAG_S = 0.3  # between a posture's end and the answer: what comes then may show that it goes on
BACK_S = 10.0  # a clock that goes back so far was set, and the stream begins anew; before that, what comes late is left out
REMEMBERED = 16  # windows
FRESH, LATE, GAP, UNKNOWN = "fresh", "late", "gap", "unknown"  # what became of a vector


@dataclass(frozen=True, eq=False)
class Plan:
    """A model made ready for streams.  kind: of its features.  lag: rows.

    kept: rows whose features are remembered, to judge a window by.
    """

    model: PostureModel
    kind: Kind
    spotting: Spotting
    period_ns: float
    lag: int
    kept: int


@dataclass(frozen=True, eq=False)
class Stream:
    """last_ns, last: the newest vector (d,) and its time; None before the first, and in a gap.

    origin_ns: time of row 0.  rows: features (r, d) of the newest rows, the last of them row number `hypotheses.rows` - 1.
    movements: those that no window has explained yet.  windows: the newest ones that were answered.
    waiting: answers that were found and not yet given.
    """

    hypotheses: Hypotheses
    moving: Moving
    rows: Floats
    last_ns: int = -1
    last: Floats | None = None
    origin_ns: int = 0
    movements: tuple[Stretch, ...] = ()
    windows: tuple[Stretch, ...] = ()
    waiting: tuple["Answer", ...] = ()


@dataclass(frozen=True, eq=False)
class Answer:
    """A stretch of time and what it was.  label: None for a movement that no posture explains.  rows: that were judged."""

    label: str | None
    start_ns: int
    end_ns: int
    rows: int
    judgement: Judgement


def plan_of(model: PostureModel, strictness: float = STRICTNESS) -> Plan:
    """strictness: see `spotting`.  Raises ValueError for features that this version does not know."""
    kind = next((kind for kind in KINDS if kind == model.features), None)
    if kind is None:
        raise ValueError(f"features = {model.features!r}: allowed: {', '.join(KINDS)}")
    spotting = spotting_of(model, strictness)
    lag = max(1, round(LAG_S * model.rate))
    return Plan(model, kind, spotting, 1e9 / model.rate, lag, 2 * spotting.window + lag)


def beginning(plan: Plan) -> Stream:
    """Before the first vector."""
    return Stream(hypotheses_of(plan.spotting), Moving(), np.zeros((0, len(plan.model.mean))))


def heard(plan: Plan, stream: Stream, captured_ns: int, features: Floats) -> tuple[Stream, Answer | None, str]:
    """One more vector (d,), not finite while the person is lost; at most one answer, and what became of the vector.

    FRESH: it was used.  UNKNOWN: it is not finite.  LATE: it is not later than the one before, and left out, without an
    answer.  GAP: it is the first after a gap.
    """
    if captured_ns <= stream.last_ns and stream.last_ns - captured_ns < BACK_S * 1e9:
        return stream, None, LATE
    if not np.isfinite(features).all():
        ended = captured_ns < stream.last_ns or captured_ns - stream.last_ns > MAX_GAP_S * 1e9
        return *_next(_ended(plan, stream) if ended else stream), UNKNOWN
    became = FRESH
    if stream.last is None or captured_ns < stream.last_ns or captured_ns - stream.last_ns > MAX_GAP_S * 1e9:
        became = FRESH if stream.last_ns < 0 else GAP
        stream = replace(_ended(plan, stream), origin_ns=captured_ns, last=features, last_ns=captured_ns)
        stream = _row(plan, stream, features)
    else:
        stream = _rows_until(plan, stream, captured_ns, features)
    return *_next(stream), became


def _rows_until(plan: Plan, stream: Stream, captured_ns: int, features: Floats) -> Stream:
    """With the rows between the vector before and this one, this one's own time included."""
    before_ns, before = stream.last_ns, stream.last
    assert before is not None
    while (row_ns := _time_of(plan, stream, stream.hypotheses.rows)) <= captured_ns:
        share = (row_ns - before_ns) / (captured_ns - before_ns)
        stream = _row(plan, stream, before + share * (features - before))
    return replace(stream, last_ns=captured_ns, last=features)


def _row(plan: Plan, stream: Stream, features: Floats) -> Stream:
    """With one row (d,) more, and what is found then."""
    model = plan.model
    rows = np.concatenate([stream.rows[-(plan.kept - 1) :], features[None]])
    place = whiten(model, features)
    hypotheses = carried_on(plan.spotting, stream.hypotheses, int(symbols_of(model, features[None])[0]), place)
    hypotheses, window = settled(hypotheses, plan.lag)
    moving, stretch = moved(model, stream.moving, place, hypotheses.rows - 1, 2 * plan.spotting.window)
    movements = (*stream.movements, stretch) if stretch is not None else stream.movements
    stream = replace(stream, rows=rows, hypotheses=hypotheses, moving=moving, movements=movements)
    if window is not None:
        stream = _found(plan, stream, window)
    return _unexplained(plan, stream)


def _ended(plan: Plan, stream: Stream) -> Stream:
    """Nothing more comes: what has ended is answered, the rest forgotten."""
    while True:
        hypotheses, window = settled(stream.hypotheses, 0)
        if window is None:
            break
        stream = _found(plan, replace(stream, hypotheses=hypotheses), window)
    return replace(beginning(plan), waiting=stream.waiting, last_ns=stream.last_ns)


def _found(plan: Plan, stream: Stream, window: Window) -> Stream:
    """With the answer to a window."""
    stretch = Stretch(window.begin, window.end)
    windows = (*stream.windows, stretch)[-REMEMBERED:]
    return _answered(plan, replace(stream, windows=windows), stretch, posture=True)


def _unexplained(plan: Plan, stream: Stream) -> Stream:
    """Movements that windows explain are forgotten, and those that no window may explain any more are told."""
    left = [stretch for stretch in stream.movements if stretch.covered(stream.windows) < SHARE]
    due = [stretch for stretch in left if stretch.end - pending(stream.hypotheses) <= SHARE * (stretch.end - stretch.begin)]
    stream = replace(stream, movements=tuple(stretch for stretch in left if stretch not in due))
    for stretch in due:
        stream = _answered(plan, stream, stretch, posture=False)
    return stream


def _answered(plan: Plan, stream: Stream, stretch: Stretch, *, posture: bool) -> Stream:
    """With the answer to a stretch, judged as far back as rows are remembered.  posture: it may be one."""
    first = stream.hypotheses.rows - len(stream.rows)
    rows = stream.rows[max(stretch.begin - first, 0) : stretch.end - first]
    judgement = judge(plan.model, rows)
    label = plan.model.labels[judgement.best] if posture and judgement.known else None
    times = (_time_of(plan, stream, stretch.begin), _time_of(plan, stream, stretch.end - 1))
    return replace(stream, waiting=(*stream.waiting, Answer(label, *times, len(rows), judgement)))


def _time_of(plan: Plan, stream: Stream, row: int) -> int:
    return stream.origin_ns + round(row * plan.period_ns)


def _next(stream: Stream) -> tuple[Stream, Answer | None]:
    """The first answer that waits, which is then given."""
    if not stream.waiting:
        return stream, None
    return replace(stream, waiting=stream.waiting[1:]), stream.waiting[0]
