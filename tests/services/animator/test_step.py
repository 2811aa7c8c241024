"""Step of the animator: the shown state."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from tests.common.runtime.test_frame_rate import decision
from tests.support.animator_stand_in import NOW, after, assignment, bap, body, body_message, pose_at, sighting
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.rig import demo_rig
from zenocap.services.animator.parameters import MAX_ENTRIES
from zenocap.services.animator.step import counts, describe
from zenocap.services.viewer.shell import camera_info


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
    assert (state.actors, counts(state)) == ({}, {"unusable": 0})


@pytest.mark.parametrize("anatomy", ["ten-parts", "seventy-parts"])
def test_bodies_and_poses_of_unknown_anatomies_are_counted_and_ignored(anatomy: str) -> None:
    known = body_message(NOW)
    bad_body = structs.replace(known, body=m.Body(anatomy=anatomy, sizes={}, offsets=known.body.offsets))
    state = after(known, bap(1, NOW, pose_at(0.0)))
    worse = after(bad_body, built(m.UniversalBap, captured_ns=NOW, angles={"tail.x": 1.0}), state=state)
    assert counts(worse) == {"unusable": 2}
    assert replace(worse, unusable=0) == state


def test_a_person_who_is_being_measured_is_lost_until_the_next_pose() -> None:
    state = after(body_message(NOW), bap(1, NOW, pose_at(0.0)), assignment(2, NOW, pose_at(0.0), tracking=False))
    assert state.actors["two-view"].lost == ("person",)
    assert after(bap(3, NOW, pose_at(0.0)), state=state).actors["two-view"].lost == ()


def test_the_state_has_the_latest_sighting_and_assignment() -> None:
    here = assignment(3, NOW, pose_at(0.0))
    shown = after(sighting("1", 1, NOW), sighting("1", 2, NOW), here)
    assert shown.sightings["1"].frame == 2
    assert shown.assignment == here


def test_an_impossible_camera_is_counted_and_ignored() -> None:
    info = camera_info(demo_rig("two-view").viewers[0], NOW)
    state = after(structs.replace(info, matrix=[1.0] * 9))
    assert (dict(state.cameras), counts(state)) == ({}, {"unusable": 1})


def test_the_frame_rate_that_is_shown_is_the_one_that_viewers_follow() -> None:
    """One that a later one has overtaken was shown."""
    own = decision(1, 2, captured_ns=NOW, from_ns=NOW)
    false = structs.replace(own, captured_ns=NOW - 1, of=6)
    assert after(own, false).frame_rate == own
    assert after(structs.replace(false, captured_ns=2**62), own).frame_rate == own


def test_unknown_viewers_are_limited_in_number_and_do_not_displace_the_rigs_own() -> None:
    invented = [sighting(f"s{k}", 0, NOW) for k in range(2 * MAX_ENTRIES)]
    shown = after(*invented, sighting("1", 0, NOW), sighting("2", 0, NOW)).sightings
    assert {"1", "2"} <= set(shown)
    assert len(shown) <= MAX_ENTRIES
