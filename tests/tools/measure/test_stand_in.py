"""Stand-ins publish recorded messages on schedule and answer the integrator."""

from itertools import islice

import pytest
from typer.testing import CliRunner

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import ASSIGNMENT
from zenocap.services.viewer.sources.playback import Playback
from zenocap.tools.measure.recorded_messages import RecordedMessages
from zenocap.tools.measure.scene import FILM_FPS
from zenocap.tools.measure.stand_in import DueFrame, StandIn, due_frames, program, step

S = 1_000_000_000


def recorded(number: int) -> RecordedMessages:
    silhouette = built(m.Silhouette, frame=number, size=(4, 3), region=(0, 0, 4, 3), data=b"%d" % number)
    sighting = built(m.Sighting, frame=number)
    bap = built(m.PartialBap, frame=number, view="flank", score=number / 10)
    return RecordedMessages(silhouette, sighting, bap)


SETUP = StandIn("1", tuple(map(recorded, range(3))), FILM_FPS)


def assignment(frame: int, *, stale: bool = False) -> Envelope:
    views = {"1": m.ViewAssignment(frame=frame, view="facade", scale=1.0, stale=stale)}
    message = built(m.Assignment, frame=frame, captured_ns=7, views=views)
    return Envelope("zenocap/r/integrator/assignment", ASSIGNMENT, message, 0)


def test_a_frame_has_the_recorded_messages_with_its_own_number_and_time() -> None:
    waiting, messages = step(SETUP, None, DueFrame(5, 99))  # 0 1 2 1 0 1
    silhouette, sighting = messages
    assert isinstance(silhouette, m.Silhouette)
    assert (silhouette.frame, silhouette.captured_ns, silhouette.data) == (5, 99, b"1")
    assert isinstance(sighting, m.Sighting)
    assert (sighting.frame, sighting.captured_ns) == (5, 99)
    assert waiting == DueFrame(5, 99)


def test_assignment_to_the_waiting_frame_is_answered_once() -> None:
    waiting, _ = step(SETUP, None, DueFrame(2, 99))
    after, messages = step(SETUP, waiting, assignment(2))
    assert after is None
    (bap,) = messages
    assert isinstance(bap, m.PartialBap)
    assert (bap.frame, bap.captured_ns, bap.view, bap.score) == (2, 99, "facade", 0.2)
    assert step(SETUP, after, assignment(2)) == (None, [])


@pytest.mark.parametrize("event", [assignment(1), assignment(2, stale=True)])
def test_other_assignments_are_not_answered(event: Envelope) -> None:
    waiting = DueFrame(2, 99)
    assert step(SETUP, waiting, event) == (waiting, [])


def test_frames_are_due_by_the_schedule() -> None:
    clock = ManualClock(10 * S)
    frames = due_frames(10.0, Playback(9 * S, clock, sleep=lambda seconds: clock.advance(round(seconds * S))))
    assert [(f.frame, f.captured_ns) for f in islice(frames, 2)] == [(10, 10 * S), (11, 10 * S + S // 10)]
    clock.advance(S)
    assert next(frames).frame == 21


def test_film_without_messages_is_a_one_line_error(tmp_path) -> None:
    result = CliRunner().invoke(program, ["stand-in", str(tmp_path / "none.toml"), "--id", "1"])
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert "none.toml" in result.stderr
