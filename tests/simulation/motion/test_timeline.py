"""Time lines: order of segments, and motion without jumps."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support.joint_paths import joint_paths, top_speed
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.postures import POSTURES
from zenocap.simulation.motion.timeline import (
    EMPTY,
    LOWERING,
    RETURNING,
    STANDING,
    STRETCHED,
    MotionTimeline,
    demo_timeline,
    motion_timeline,
    posture_timeline,
    session_timeline,
)

FASTEST_M_S = 7.5  # a foot in a kick
FASTEST_FIST_M_S = 11.0


def fastest(script: MotionTimeline, from_s: float, to_s: float) -> float:
    """Speed of the fastest joint centre, metres per second."""
    paths = joint_paths(script.person, script, from_s, to_s)
    return top_speed({marker.name: paths[marker.name] for marker in TEN_PARTS.markers})


def test_take_starts_with_the_empty_scene_and_the_initial_posture() -> None:
    subject = person(3)
    script = posture_timeline(subject, "squat", 5)
    assert [s.name for s in script.segments] == ["empty", "stretched", "lowering", "squat"]
    assert script.pose_at(0.5) is None
    true = truth(subject, script.pose_at(1.8))
    joints = true.joints
    for side, out in (("R", -1.0), ("L", 1.0)):
        arm = joints[f"{side}Wrist"] - joints[f"{side}Shoulder"]
        assert abs(arm[1]) < 0.04
        assert arm[0] * out > 0.95 * np.linalg.norm(arm)
    assert abs(true.yaw) < 0.05
    assert script.motion_from_s == pytest.approx(3.1)
    assert script.segments[-1].start_s == script.motion_from_s


def test_segments_follow_each_other_without_gaps() -> None:
    assert all(one.end_s == following.start_s for one, following in pairwise(demo_timeline(person(1), 0).segments))


@pytest.mark.nightly
@pytest.mark.parametrize("name", POSTURES)
@pytest.mark.parametrize("seed", [2, 17])
def test_posture_take_has_no_jumps(name: str, seed: int) -> None:
    script = posture_timeline(person(seed), name, seed + 1)
    assert fastest(script, 1.0, script.duration_s + 0.5) < FASTEST_M_S


@pytest.mark.nightly
def test_demo_has_no_jumps_even_where_it_repeats() -> None:
    script = demo_timeline(person(0), 0)
    assert fastest(script, 3.0, script.duration_s + script.period_s + 1.0) < FASTEST_M_S


def test_demo_has_all_movements_and_repeats_from_the_initial_posture() -> None:
    script = demo_timeline(person(4), 1)
    names = {s.name for s in script.segments}
    assert {"stretched", "walking", "swing-both-arms", "squat", "kick-right", "turning"} <= names
    assert {"raise-right-arm", "raise-left-arm", "raise-both-arms"} <= names  # steer the slide show of the page
    assert script.segment_at(script.duration_s + 0.1).name == "stretched"
    assert script.pose_at(script.duration_s + 0.1) is not None
    assert script.segment_at(script.duration_s + 2.5 * script.period_s) in script.segments


@pytest.mark.slow
def test_the_demo_stays_in_the_action_region() -> None:
    hip = joint_paths(person(22), demo_timeline(person(22), 1), 3.0, step_s=0.2)["Hip"]
    assert np.hypot(hip[:, 0], hip[:, 2]).max() < 1.7


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "most_m_s"),
    [*((name, FASTEST_M_S) for name in ("walking", "turning", "turn-and-walk", "march")),
     ("running", FASTEST_FIST_M_S), ("boxing", FASTEST_FIST_M_S)],
)  # fmt: skip
def test_single_motion_repeats_in_the_room_without_jumps(name: str, most_m_s: float) -> None:
    script = motion_timeline(person(5), name, 1)
    assert script.segment_at(script.duration_s + 0.1).name == name
    assert fastest(script, 3.0, script.duration_s + 2.0) < most_m_s
    hip = joint_paths(script.person, script, 7.0, step_s=0.25)["Hip"]
    assert np.hypot(hip[:, 0], hip[:, 2]).max() < 2.9


def test_person_stands_and_sways_after_the_end_of_a_take() -> None:
    script = posture_timeline(person(5), "march", 0)
    first, second = joint_paths(script.person, script, script.duration_s + 1.0, script.duration_s + 2.5, 1.0)["Head"]
    assert 1e-5 < np.linalg.norm(first - second) < 0.05


@pytest.mark.nightly
def test_session_movements_are_in_order_and_start_near_the_origin() -> None:
    movements = [("turn-and-walk", 0), ("bend", 3), ("squat", 1)]
    script = session_timeline(person(5), movements, [0.5, 0.0, 0.7], 2)
    names = [segment.name for segment in script.segments]
    assert names == [
        EMPTY, STRETCHED, LOWERING, STANDING, "turn-and-walk", STANDING, RETURNING, "bend", STANDING, "squat", STANDING
    ]  # fmt: skip
    assert fastest(script, 1.0, script.duration_s) < FASTEST_M_S
    for segment in script.segments:
        if segment.name in dict(movements):
            assert np.hypot(segment.start.x, segment.start.z) < 0.25


def test_session_rejects_an_unknown_movement() -> None:
    with pytest.raises(ValueError, match="movement 'handstand' is not one of march, "):
        session_timeline(person(5), [("handstand", 0)], [0.0], 0)


def test_time_before_the_start_is_an_error() -> None:
    for time_s in (-0.1, float("nan")):
        with pytest.raises(ValueError, match=r"time_s = .*, allowed 0 or more"):
            posture_timeline(person(5), "march", 0).pose_at(time_s)
