"""The animator's step: who is there, who is silent, and what is shown."""

from dataclasses import replace

import numpy as np
import pytest
from animator_stand_in import SETUP, assignment, bap, body, body_message, health, pose_at, said, sighting
from hypothesis import given
from hypothesis import strategies as st

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Alive, Tick
from services.animator.snapshot import Condition
from services.animator.states import MOST, SILENT_NS, STALE_NS, Setup, State
from services.animator.step import condition, counts, describe, initial_state, snapshot, step

NOW = 1_000_000_000_000
VIEWER = ("viewer", "1")


def after(*events: m.Message | Alive | Tick, state: State | None = None, now_ns: int = NOW) -> State:
    state = state or initial_state(SETUP)
    for event in events:
        one = event if isinstance(event, Alive | Tick) else said(event, now_ns)
        state, messages = step(SETUP, state, one)
        assert messages == []
    return state


def seen_at(state: State, now_ns: int) -> Condition:
    return condition(after(Tick(now_ns), state=state), VIEWER)


def test_a_service_that_nobody_has_heard_is_starting() -> None:
    assert condition(after(Tick(NOW)), VIEWER) == "starting"
    assert condition(after(Alive("viewer", "1", True, NOW), Tick(NOW)), VIEWER) == "starting"


def test_a_viewer_whose_frames_stop_is_stale_after_a_second_though_its_health_goes_on() -> None:
    state = after(sighting("1", 0, NOW))
    assert seen_at(state, NOW + STALE_NS) == "well"
    state = after(health("viewer", "1", NOW), state=state, now_ns=NOW + STALE_NS)
    assert seen_at(state, NOW + STALE_NS + 1) == "stale"


def test_a_viewer_that_learns_the_background_says_its_health_alone_and_is_well() -> None:
    state = after(Alive("viewer", "1", True, NOW), health("viewer", "1", NOW, "learning the background (9 frames)"))
    assert seen_at(state, NOW + STALE_NS + 1) == "well"
    assert seen_at(state, NOW + SILENT_NS + 1) == "stale"


def test_a_viewer_that_went_is_gone_until_it_says_something() -> None:
    state = after(sighting("1", 0, NOW), Alive("viewer", "1", False, NOW + 1))
    assert seen_at(state, NOW + 2) == "gone"
    back = after(sighting("1", 1, NOW + 3), state=state, now_ns=NOW + 3)
    assert seen_at(back, NOW + 4) == "well"


def test_a_viewer_that_comes_back_may_learn_the_background_again() -> None:
    state = after(sighting("1", 0, NOW), Alive("viewer", "1", False, NOW + 1), Alive("viewer", "1", True, NOW + 2))
    state = after(health("viewer", "1", NOW), state=state, now_ns=NOW + 2 * STALE_NS)
    assert seen_at(state, NOW + 2 * STALE_NS + 1) == "well"


@given(silent_ns=st.integers(0, 20 * STALE_NS))
def test_silence_never_gets_better_by_itself(silent_ns: int) -> None:
    order = ["well", "stale"]
    state = after(sighting("1", 0, NOW))
    earlier, later = seen_at(state, NOW + silent_ns // 2), seen_at(state, NOW + silent_ns)
    assert order.index(earlier) <= order.index(later)


def test_what_is_stale_or_gone_is_said_in_words() -> None:
    state = after(sighting("1", 0, NOW), Tick(NOW + 2 * STALE_NS))
    assert describe(state) == "waiting for a pose; stale or gone: viewer 1"


def test_a_pose_becomes_the_actor_that_the_kinematics_place() -> None:
    pose = pose_at(0.4)
    state = after(body_message(NOW), bap(7, NOW - 5, pose, ["left_arm"]))
    actor = snapshot(state).actors["two-view"]
    assert (actor.frame, actor.captured_ns, actor.received_ns, actor.lost) == (7, NOW - 5, NOW, ("left_arm",))
    assert actor.anatomy is TEN_PARTS
    np.testing.assert_array_equal(actor.pose.angles, pose.angles)
    np.testing.assert_array_equal(actor.pose.position, pose.position)
    np.testing.assert_array_equal(actor.body.sizes, body().sizes)


def test_a_pose_without_a_body_waits_for_it() -> None:
    state = after(bap(1, NOW, pose_at(0.0)))
    assert snapshot(state).actors == {}
    assert counts(state) == {"unusable": 0}


@pytest.mark.parametrize("anatomy", ["ten-parts", "seventy-parts"])
def test_what_fits_no_body_known_here_is_counted_and_changes_nothing(anatomy: str) -> None:
    said_body = body_message(NOW)
    bad_body = m.UniversalBdp(
        frame=0, captured_ns=NOW, ratio=1.0, body=m.Body(anatomy=anatomy, sizes={}, offsets=said_body.body.offsets)
    )
    bad_pose = m.UniversalBap(
        frame=0, captured_ns=NOW, position=(0.0, 1.0, 0.0), angles={"tail.x": 1.0}, scores={}, views={}, stale=[], lost=[]
    )
    state = after(said_body, bap(1, NOW, pose_at(0.0)))
    worse = after(bad_body, bad_pose, state=state)
    assert counts(worse) == {"unusable": 2}
    assert replace(worse, unusable=0, services=state.services, now_ns=state.now_ns) == state


def test_a_person_who_is_measured_anew_is_shown_as_lost_until_there_is_a_pose() -> None:
    state = after(body_message(NOW), bap(1, NOW, pose_at(0.0)), assignment(2, NOW, pose_at(0.0), tracking=False))
    assert snapshot(state).actors["two-view"].lost == ("person",)
    state = after(bap(3, NOW, pose_at(0.0)), state=state)
    assert snapshot(state).actors["two-view"].lost == ()


def test_services_beyond_the_expected_are_shown_too() -> None:
    state, _ = step(Setup(), initial_state(Setup()), said(health("recorder", "here", NOW), NOW))
    assert [(row.service, row.id, row.condition) for row in snapshot(state).rows] == [("recorder", "here", "well")]


def test_the_last_of_everything_is_in_the_snapshot() -> None:
    here = assignment(3, NOW, pose_at(0.0))
    shown = snapshot(after(sighting("1", 1, NOW), sighting("1", 2, NOW), here))
    assert shown.sightings["1"].frame == 2
    assert shown.assignment == here


def test_strangers_do_not_fill_its_memory() -> None:
    many = [event for k in range(2 * MOST) for event in (Alive("viewer", f"s{k}", True, NOW), sighting(f"s{k}", 0, NOW))]
    state = after(*many)
    assert len(state.services) <= MOST
    assert len(state.sightings) <= MOST
    assert set(SETUP.expected) <= set(state.services)
