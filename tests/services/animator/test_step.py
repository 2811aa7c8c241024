"""Step of the animator: the shown state."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from tests.support.animator_stand_in import SETUP, assignment, bap, body, body_message, pose_at, received, sighting
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.rig import demo_rig
from zenocap.services.animator.parameters import MAX_ENTRIES
from zenocap.services.animator.states import AnimatorState
from zenocap.services.animator.step import counts, describe, step
from zenocap.services.viewer.shell import camera_info

NOW = 1_000_000_000_000


def after(*events: m.Message, state: AnimatorState | None = None, now_ns: int = NOW) -> AnimatorState:
    state = state or AnimatorState()
    for event in events:
        state, messages = step(SETUP, state, received(event, now_ns))
        assert messages == []
    return state


def test_the_health_text_names_what_is_shown() -> None:
    assert describe(after()) == "waiting for a pose"
    assert describe(after(body_message(NOW), bap(1, NOW, pose_at(0.0)))) == "showing two-view"


def test_a_pose_becomes_the_actor() -> None:
    pose = pose_at(0.4)
    state = after(body_message(NOW), bap(7, NOW - 5, pose, ["left_arm"]))
    actor = state.actors["two-view"]
    assert (actor.frame, actor.captured_ns, actor.received_ns, actor.lost) == (7, NOW - 5, NOW, ("left_arm",))
    assert actor.anatomy is TEN_PARTS
    np.testing.assert_array_equal(actor.pose.angles, pose.angles)
    np.testing.assert_array_equal(actor.pose.position, pose.position)
    np.testing.assert_array_equal(actor.body.sizes, body().sizes)


def test_a_pose_before_its_body_is_ignored() -> None:
    state = after(bap(1, NOW, pose_at(0.0)))
    assert state.actors == {}
    assert counts(state) == {"unusable": 0}


@pytest.mark.parametrize("anatomy", ["ten-parts", "seventy-parts"])
def test_bodies_and_poses_of_unknown_anatomies_are_counted_and_ignored(anatomy: str) -> None:
    known_body = body_message(NOW)
    bad_body = m.UniversalBdp(
        frame=0, captured_ns=NOW, ratio=1.0, body=m.Body(anatomy=anatomy, sizes={}, offsets=known_body.body.offsets)
    )
    bad_pose = m.UniversalBap(
        frame=0, captured_ns=NOW, position=(0.0, 1.0, 0.0), angles={"tail.x": 1.0}, scores={}, views={}, stale=[], lost=[]
    )
    state = after(known_body, bap(1, NOW, pose_at(0.0)))
    worse = after(bad_body, bad_pose, state=state)
    assert counts(worse) == {"unusable": 2}
    assert replace(worse, unusable=0) == state


def test_a_person_who_is_being_measured_is_lost_until_the_next_pose() -> None:
    state = after(body_message(NOW), bap(1, NOW, pose_at(0.0)), assignment(2, NOW, pose_at(0.0), tracking=False))
    assert state.actors["two-view"].lost == ("person",)
    state = after(bap(3, NOW, pose_at(0.0)), state=state)
    assert state.actors["two-view"].lost == ()


def test_the_state_has_the_latest_sighting_and_assignment() -> None:
    here = assignment(3, NOW, pose_at(0.0))
    shown = after(sighting("1", 1, NOW), sighting("1", 2, NOW), here)
    assert shown.sightings["1"].frame == 2
    assert shown.assignment == here


def test_an_impossible_camera_is_counted_and_ignored() -> None:
    info = camera_info(demo_rig("two-view").viewers[0], NOW)
    state = after(msgspec.structs.replace(info, matrix=[1.0] * 9))
    assert dict(state.cameras) == {}
    assert counts(state) == {"unusable": 1}


def test_unknown_viewers_are_limited_in_number() -> None:
    assert len(after(*[sighting(f"s{k}", 0, NOW) for k in range(2 * MAX_ENTRIES)]).sightings) <= MAX_ENTRIES


def test_invented_viewers_do_not_displace_the_rigs_own() -> None:
    invented = [sighting(f"s{k}", 0, NOW) for k in range(2 * MAX_ENTRIES)]
    state = after(*invented, sighting("1", 0, NOW), sighting("2", 0, NOW))
    assert {"1", "2"} <= set(state.sightings)
