"""A restarted integrator continues with the body and pose published before."""

import numpy as np
import pytest
from msgspec.structs import replace

from tests.support.built_messages import built
from tests.support.perfect_viewers import HIPS, INITIAL_MESSAGES, SETUP, TRACKED, partial_bdp, play, sighting
from tests.support.two_view_run import VIEWERS
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.bus.protocol import Tick
from zenocap.services.integrator import step as integrator
from zenocap.services.integrator.state_recovery import standing_height
from zenocap.services.integrator.states import IntegratorState
from zenocap.services.integrator.step import awaits_recovery

BODY, POSE = INITIAL_MESSAGES[-2:]


def restarted_with(*messages: m.Message) -> tuple[IntegratorState, list[m.Message]]:
    return play(integrator.initial_state(SETUP), *messages)


def test_recovered_body_and_pose_resume_tracking_and_are_published_again() -> None:
    state, published = restarted_with(BODY, POSE)
    assert published == [BODY, POSE]
    assert integrator.describe(state) == "tracking"
    assert not awaits_recovery(state)
    np.testing.assert_array_equal(state.person.pose.angles, TRACKED.person.pose.angles)
    np.testing.assert_array_equal(state.person.bdp.sizes, TRACKED.person.bdp.sizes)
    assert state.views == POSE.views
    _, (assignment,) = play(state, sighting("1", 30), sighting("2", 30))
    assert assignment.tracking


def test_tracking_resumes_with_one_viewer() -> None:
    state, _ = restarted_with(BODY, POSE)
    _, published = play(state, *(sighting("1", frame) for frame in range(30, 40)))
    assert any(isinstance(message, m.Assignment) and message.tracking for message in published)


def test_a_recovered_pose_without_its_body_is_ignored() -> None:
    state, published = restarted_with(POSE)
    assert published == []
    assert awaits_recovery(state)
    state, published = play(state, BODY, BODY, POSE)
    assert published == [BODY, POSE]


def test_recovered_messages_are_ignored_after_the_body_is_measured() -> None:
    assert play(TRACKED, BODY, POSE) == (TRACKED, [])


def test_a_body_that_is_not_the_published_one_is_contradicted_once_a_tick() -> None:
    """Viewers used that of another program until the end."""
    small = replace(BODY.body, sizes=dict.fromkeys(BODY.body.sizes, (0.1, 0.1, 0.1)))
    false = replace(BODY, captured_ns=2**62, body=small)
    state, published = play(TRACKED, *[false] * 20)
    assert published == []
    state, bodies = ticked(state)
    assert bodies == [BODY]
    state, _ = play(state, BODY)  # its own, which it receives too
    assert ticked(state)[1] == []
    state, _ = play(state, false, m.Request(frame=0, captured_ns=0, what="measure"))
    assert ticked(state)[1] == []  # there is none until the next


def ticked(state: IntegratorState) -> tuple[IntegratorState, list[m.Message]]:
    """State after a tick, and the bodies that are published in it."""
    state, published = integrator.step(SETUP, state, Tick(BODY.captured_ns + 10**9))
    return state, [message for message in published if isinstance(message, m.UniversalBdp)]


def test_recovered_messages_are_ignored_after_a_measure_request() -> None:
    state, _ = play(TRACKED, m.Request(frame=0, captured_ns=0, what="measure"))
    assert not awaits_recovery(state)
    after, published = play(state, BODY, POSE)
    assert (after.person, published) == (None, [])
    t_poses = [message(viewer, k) for k in range(40, 48) for viewer in VIEWERS for message in (sighting, partial_bdp)]
    assert play(state, *t_poses)[0].person is not None


def test_a_body_or_pose_of_another_rig_is_refused() -> None:
    other_anatomy = replace(BODY, body=m.Body(anatomy="fourteen-parts", sizes={}, offsets={}))
    other_viewers = built(m.UniversalBap, views={"left": "facade", "right": "flank"})
    state, published = restarted_with(other_anatomy, POSE, BODY, other_viewers)
    assert (state.person, published) == (None, [BODY])


@pytest.mark.parametrize("height", [1.5, 1.75, 1.95])
def test_standing_height_is_that_of_the_hips(height: float) -> None:
    body = body_from_lengths(TEN_PARTS, average_lengths(height))
    assert standing_height(TEN_PARTS, body) == pytest.approx(0.53 * height)
    assert HIPS[1] == pytest.approx(TRACKED.person.height)
