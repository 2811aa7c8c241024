"""Recognition in a stream of feature vectors that may be irregular in time, of any rate, with gaps.

Vectors are resampled linearly to the model's rate, row k at `origin_ns` plus k periods, so that results depend only on
the vectors and their times.  `segmentation` finds postures among the rows; `movement` finds movements without a
posture.  A gap of more than MAX_STREAM_GAP_S ends the segmentation before it; nothing is interpolated across it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.recognizer import parameters as p
from zenocap.services.recognizer.ignored_parts import without_parts
from zenocap.services.recognizer.model import Classification, PostureModel, classify, symbols_of, whiten
from zenocap.services.recognizer.movement import MovementState, RowRange, detect_movement
from zenocap.services.recognizer.segmentation import (
    Hypotheses,
    SegmentationSetup,
    Window,
    advance,
    first_open_row,
    initial_hypotheses,
    pop_window,
    segmentation_setup,
)

USED, LATE, GAP, LOST = "used", "late", "gap", "lost"  # use of a vector, see `push`


@dataclass(frozen=True, eq=False)
class StreamSetup:
    """A model prepared for streams.

    delay: rows between the end of a posture and its answer.  kept: rows of features that are kept to classify a window.
    """

    model: PostureModel
    segmentation: SegmentationSetup
    period_ns: float
    delay: int
    kept: int


@dataclass(frozen=True, eq=False)
class PoseStream:
    """State of a stream.

    last_ns, last: time and vector (d,) of the latest input; -1 and None before the first, None in a gap.
    origin_ns: time of row 0.  rows: (r, d) the latest rows, the last is row number `hypotheses.rows` - 1.
    movements: not explained by a window yet.  windows: the latest answered ones.  queue: results not returned yet.
    """

    hypotheses: Hypotheses
    movement: MovementState
    rows: Floats
    last_ns: int = -1
    last: Floats | None = None
    origin_ns: int = 0
    movements: tuple[RowRange, ...] = ()
    windows: tuple[RowRange, ...] = ()
    queue: tuple["Recognition", ...] = ()


@dataclass(frozen=True, eq=False)
class Recognition:
    """Classified time span.  label: None for a movement without a posture.  rows: number of classified rows."""

    label: str | None
    start_ns: int
    end_ns: int
    rows: int
    classification: Classification


def stream_setup(model: PostureModel, strictness: float = p.STRICTNESS) -> StreamSetup:
    """Prepare a model.  strictness: see `parameters.STRICTNESS`."""
    segmentation = segmentation_setup(model, strictness)
    delay = max(1, round(p.ANSWER_DELAY_S * model.rate))
    return StreamSetup(model, segmentation, 1e9 / model.rate, delay, 2 * segmentation.window + delay)


def initial_stream(setup: StreamSetup) -> PoseStream:
    """State before the first vector."""
    return PoseStream(initial_hypotheses(setup.segmentation), MovementState(), np.zeros((0, 0)))


def push(
    setup: StreamSetup, stream: PoseStream, captured_ns: int, features: Floats
) -> tuple[PoseStream, Recognition | None, str]:
    """Add a vector (d,), not finite while the person is lost; return the stream, at most one result and its use.

    USED.  LOST: not finite.  LATE: not later than the vector before, ignored, no result.  GAP: used, first after a gap.
    """
    if captured_ns <= stream.last_ns and stream.last_ns - captured_ns < p.CLOCK_RESET_S * 1e9:
        return stream, None, LATE
    if not np.isfinite(features).all():
        ended = captured_ns < stream.last_ns or captured_ns - stream.last_ns > p.MAX_STREAM_GAP_S * 1e9
        return *_pop(_end(setup, stream) if ended else stream), LOST
    use, features = USED, without_parts(features, setup.model.ignored)
    if stream.last is None or captured_ns < stream.last_ns or captured_ns - stream.last_ns > p.MAX_STREAM_GAP_S * 1e9:
        use = USED if stream.last_ns < 0 else GAP
        stream = replace(_end(setup, stream), origin_ns=captured_ns, last=features, last_ns=captured_ns)
        stream = _add_row(setup, stream, features)
    else:
        stream = _resample(setup, stream, captured_ns, features)
    return *_pop(stream), use


def recognitions(setup: StreamSetup, times_ns: Sequence[int], rows: Floats) -> Iterator[tuple[int, Recognition]]:
    """Results of a stream of rows (T, d) at these times, each with the number of the row at which it comes.

    Those that still wait at its end, and those of the windows that have ended then, have T: a gap would give them.
    """
    stream = initial_stream(setup)
    for number, (captured_ns, row) in enumerate(zip(times_ns, rows, strict=True)):
        stream, found, _ = push(setup, stream, captured_ns, row)
        if found is not None:
            yield number, found
    yield from ((len(rows), found) for found in _end(setup, stream).queue)


def _resample(setup: StreamSetup, stream: PoseStream, captured_ns: int, features: Floats) -> PoseStream:
    """Add the rows after the vector before, up to and including this vector's time."""
    before_ns, before = stream.last_ns, stream.last
    assert before is not None
    while (row_ns := _time_of(setup, stream, stream.hypotheses.rows)) <= captured_ns:
        share = (row_ns - before_ns) / (captured_ns - before_ns)
        stream = _add_row(setup, stream, before + share * (features - before))
    return replace(stream, last_ns=captured_ns, last=features)


def _add_row(setup: StreamSetup, stream: PoseStream, features: Floats) -> PoseStream:
    """Add one row (d,) and the results that follow from it."""
    model = setup.model
    kept = stream.rows[-(setup.kept - 1) :]
    rows = np.concatenate([kept, features[None]]) if len(kept) else features[None]
    whitened = whiten(model, features)
    symbol = int(symbols_of(model, features[None])[0])
    hypotheses = advance(setup.segmentation, stream.hypotheses, symbol, whitened)
    hypotheses, window = pop_window(hypotheses, setup.delay)
    number, longest = hypotheses.rows - 1, 2 * setup.segmentation.window
    movement, ended = detect_movement(model, stream.movement, whitened, number, longest)
    movements = (*stream.movements, ended) if ended is not None else stream.movements
    stream = replace(stream, rows=rows, hypotheses=hypotheses, movement=movement, movements=movements)
    if window is not None:
        stream = _add_window(setup, stream, window)
    return _report_unexplained(setup, stream)


def _end(setup: StreamSetup, stream: PoseStream) -> PoseStream:
    """Report the windows that have ended and restart; keeps the queue and the time of the latest vector."""
    while True:
        hypotheses, window = pop_window(stream.hypotheses, 0)
        if window is None:
            break
        stream = _add_window(setup, replace(stream, hypotheses=hypotheses), window)
    return replace(initial_stream(setup), queue=stream.queue, last_ns=stream.last_ns)


def _add_window(setup: StreamSetup, stream: PoseStream, window: Window) -> PoseStream:
    rows = RowRange(window.begin, window.end)
    windows = (*stream.windows, rows)[-p.WINDOWS_KEPT :]
    return _add_result(setup, replace(stream, windows=windows), rows, posture=True)


def _report_unexplained(setup: StreamSetup, stream: PoseStream) -> PoseStream:
    """Drop movements that windows explain; report those that no later window can explain."""
    left = [one for one in stream.movements if one.overlap(stream.windows) < p.EXPLAINED_SHARE]
    open_from = first_open_row(stream.hypotheses)
    due = [one for one in left if one.end - open_from <= p.EXPLAINED_SHARE * (one.end - one.begin)]
    stream = replace(stream, movements=tuple(one for one in left if one not in due))
    for one in due:
        stream = _add_result(setup, stream, one, posture=False)
    return stream


def _add_result(setup: StreamSetup, stream: PoseStream, span: RowRange, *, posture: bool) -> PoseStream:
    """Queue the result of rows, classified as far back as rows are kept.  posture: they may be one."""
    first = stream.hypotheses.rows - len(stream.rows)
    rows = stream.rows[max(span.begin - first, 0) : span.end - first]
    found = classify(setup.model, rows)
    label = setup.model.labels[found.best] if posture and found.accepted else None
    times = (_time_of(setup, stream, span.begin), _time_of(setup, stream, span.end - 1))
    return replace(stream, queue=(*stream.queue, Recognition(label, *times, len(rows), found)))


def _time_of(setup: StreamSetup, stream: PoseStream, row: int) -> int:
    return stream.origin_ns + round(row * setup.period_ns)


def _pop(stream: PoseStream) -> tuple[PoseStream, Recognition | None]:
    """Remove and return the first queued result."""
    if not stream.queue:
        return stream, None
    return replace(stream, queue=stream.queue[1:]), stream.queue[0]
