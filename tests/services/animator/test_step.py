"""Step of the animator: presence of services, and the shown state."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.animator_stand_in import SETUP, assignment, bap, body, body_message, health, pose_at, received, sighting
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.rig.rig import demo_rig
from zenocap.services.animator.parameters import FRAME_TIMEOUT_NS, MAX_ENTRIES, MESSAGE_TIMEOUT_NS
from zenocap.services.animator.states import Condition, Setup, State
from zenocap.services.animator.step import condition, counts, describe, initial_state, service_statuses, step
from zenocap.services.viewer.shell import camera_info

NOW = 1_000_000_000_000
VIEWER = ("viewer", "1")


def after(*events: m.Message | Alive | Tick, state: State | None = None, now_ns: int = NOW) -> State:
    state = state or initial_state(SETUP)
    for event in events:
        one = event if isinstance(event, Alive | Tick) else received(event, now_ns)
        state, messages = step(SETUP, state, one)
        assert messages == []
    return state


def condition_at(state: State, now_ns: int) -> Condition:
    return condition(after(Tick(now_ns), state=state), VIEWER)


def test_a_service_without_messages_is_starting() -> None:
    assert condition(after(Tick(NOW)), VIEWER) == "starting"
    assert condition(after(Alive("viewer", "1", True, NOW), Tick(NOW)), VIEWER) == "starting"


def test_a_viewer_without_frames_is_stale_after_a_second_even_if_its_health_continues() -> None:
    state = after(sighting("1", 0, NOW))
    assert condition_at(state, NOW + FRAME_TIMEOUT_NS) == "ok"
    state = after(health("viewer", "1", NOW), state=state, now_ns=NOW + FRAME_TIMEOUT_NS)
    assert condition_at(state, NOW + FRAME_TIMEOUT_NS + 1) == "stale"


def test_a_viewer_that_learns_the_background_is_ok_with_its_health_alone() -> None:
    state = after(Alive("viewer", "1", True, NOW), health("viewer", "1", NOW, "learning the background (9 frames)"))
    assert condition_at(state, NOW + FRAME_TIMEOUT_NS + 1) == "ok"
    assert condition_at(state, NOW + MESSAGE_TIMEOUT_NS + 1) == "stale"


def test_a_viewer_that_ended_is_gone_until_its_next_message() -> None:
    state = after(sighting("1", 0, NOW), Alive("viewer", "1", False, NOW + 1))
    assert condition_at(state, NOW + 2) == "gone"
    back = after(sighting("1", 1, NOW + 3), state=state, now_ns=NOW + 3)
    assert condition_at(back, NOW + 4) == "ok"


def test_a_viewer_that_comes_back_may_learn_the_background_again() -> None:
    state = after(sighting("1", 0, NOW), Alive("viewer", "1", False, NOW + 1), Alive("viewer", "1", True, NOW + 2))
    state = after(health("viewer", "1", NOW), state=state, now_ns=NOW + 2 * FRAME_TIMEOUT_NS)
    assert condition_at(state, NOW + 2 * FRAME_TIMEOUT_NS + 1) == "ok"


@given(silent_ns=st.integers(0, 20 * FRAME_TIMEOUT_NS))
def test_a_silent_viewer_never_becomes_ok_without_a_message(silent_ns: int) -> None:
    order = ["ok", "stale"]
    state = after(sighting("1", 0, NOW))
    earlier, later = condition_at(state, NOW + silent_ns // 2), condition_at(state, NOW + silent_ns)
    assert order.index(earlier) <= order.index(later)


def test_the_health_text_names_stale_services() -> None:
    state = after(sighting("1", 0, NOW), Tick(NOW + 2 * FRAME_TIMEOUT_NS))
    assert describe(state) == "waiting for a pose; stale or gone: viewer 1"


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
    assert replace(worse, unusable=0, services=state.services, now_ns=state.now_ns) == state


def test_a_person_who_is_being_measured_is_lost_until_the_next_pose() -> None:
    state = after(body_message(NOW), bap(1, NOW, pose_at(0.0)), assignment(2, NOW, pose_at(0.0), tracking=False))
    assert state.actors["two-view"].lost == ("person",)
    state = after(bap(3, NOW, pose_at(0.0)), state=state)
    assert state.actors["two-view"].lost == ()


def test_unexpected_services_are_shown_too() -> None:
    state, _ = step(Setup(), initial_state(Setup()), received(health("recorder", "here", NOW), NOW))
    assert [(row.service, row.id, row.condition) for row in service_statuses(state)] == [("recorder", "here", "ok")]


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


def test_unknown_services_are_limited_in_number() -> None:
    many = [
        event for k in range(2 * MAX_ENTRIES) for event in (Alive("viewer", f"s{k}", True, NOW), sighting(f"s{k}", 0, NOW))
    ]
    state = after(*many)
    assert len(state.services) <= MAX_ENTRIES
    assert len(state.sightings) <= MAX_ENTRIES
    assert set(SETUP.expected) <= set(state.services)


def test_invented_viewers_do_not_displace_the_rigs_own() -> None:
    invented = [sighting(f"s{k}", 0, NOW) for k in range(2 * MAX_ENTRIES)]
    state = after(*invented, sighting("1", 0, NOW), sighting("2", 0, NOW))
    assert {"1", "2"} <= set(state.sightings)
