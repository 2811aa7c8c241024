"""An integrator that was restarted goes on with the body and the pose that were said before, and says them again."""

from dataclasses import replace

import numpy as np
import pytest
from perfect_viewers import BEGINNING, HIPS, SETUP, TRACKED, partial_bdp, play, sighting

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.body.proportions import body_from_lengths, lengths_of_height
from services.integrator import step as integrator
from services.integrator.resuming import standing_height
from services.integrator.states import State
from services.integrator.step import knows_nobody

BODY, POSE = BEGINNING[-2:]
assert isinstance(BODY, m.UniversalBdp)
assert isinstance(POSE, m.UniversalBap)


def resumed(*said: m.Message) -> tuple[State, list[m.Message]]:
    return play(integrator.initial_state(SETUP), *said)


def shown_in(frame: int) -> list[m.Message]:
    """The initial posture in one instant, as both viewers see it."""
    return [message for viewer in ("1", "2") for message in (sighting(viewer, frame), partial_bdp(viewer, frame))]


def test_body_and_pose_of_before_let_it_track_at_once_and_are_said_again() -> None:
    state, said = resumed(BODY, POSE)
    assert said == [BODY, POSE]
    assert integrator.describe(state) == "tracking"
    assert not knows_nobody(state)
    assert state.person is not None
    assert TRACKED.person is not None
    np.testing.assert_array_equal(state.person.pose.angles, TRACKED.person.pose.angles)
    np.testing.assert_array_equal(state.person.bdp.sizes, TRACKED.person.bdp.sizes)
    assert state.views == POSE.views
    _, said = play(state, sighting("1", 30), sighting("2", 30))
    assert [type(message) for message in said] == [m.Assignment]
    assert isinstance(said[0], m.Assignment)
    assert said[0].tracking


def test_one_viewer_is_enough_to_go_on() -> None:
    state, _ = resumed(BODY, POSE)
    said: list[m.Message] = []
    for frame in range(30, 40):
        state, more = play(state, sighting("1", frame))
        said += more
    assert any(isinstance(message, m.Assignment) and message.tracking for message in said)


def test_a_pose_without_its_body_is_of_no_use() -> None:
    state, said = resumed(POSE)
    assert said == []
    assert knows_nobody(state)
    state, said = play(state, BODY, BODY, POSE)
    assert said == [BODY, POSE]


def test_what_comes_after_the_body_was_measured_is_not_heeded() -> None:
    other = replace(TRACKED)
    state, said = play(other, BODY, POSE)
    assert said == []
    assert state == other


def test_who_is_to_measure_anew_does_not_remember() -> None:
    state, _ = play(TRACKED, m.Request(frame=0, captured_ns=0, what="measure"))
    assert not knows_nobody(state)
    after, said = play(state, BODY, POSE)
    assert said == []
    assert after.person is None
    shown = [message for frame in range(40, 48) for message in shown_in(frame)]
    state, _ = play(state, *shown)
    assert state.person is not None


def test_a_body_or_pose_of_another_rig_is_refused() -> None:
    strange = m.UniversalBdp(frame=0, captured_ns=0, body=m.Body(anatomy="fourteen-parts", sizes={}, offsets={}), ratio=1.0)
    elsewhere = m.UniversalBap(
        frame=0, captured_ns=0, position=(0.0, 1.0, 0.0), angles={}, scores={}, views={"left": "facade", "right": "flank"},
        stale=[], lost=[],
    )  # fmt: skip
    state, said = resumed(strange, POSE, BODY, elsewhere)
    assert said == [BODY]
    assert state.person is None


@pytest.mark.parametrize("height", [1.5, 1.75, 1.95])
def test_standing_height_is_that_of_the_hips(height: float) -> None:
    body = body_from_lengths(TEN_PARTS, lengths_of_height(height))
    assert standing_height(TEN_PARTS, body) == pytest.approx(0.53 * height)
    assert HIPS[1] == pytest.approx(TRACKED.person.height if TRACKED.person else None)
