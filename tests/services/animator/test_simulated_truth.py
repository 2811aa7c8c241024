"""Distance of poses from the simulated person of a rig."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.animator_stand_in import NOW, after
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.rig.rig import demo_rig
from zenocap.common.rig.sources import Actor
from zenocap.services.animator.simulated_truth import distances, simulated_motion
from zenocap.services.animator.states import ActorPose, AnimatorState
from zenocap.services.viewer.shell import camera_info
from zenocap.simulation.ground_truth import true_bdp, truth

MOVED_M = np.array([0.3, 0.0, -0.4])


def state_of(
    time_s: float, move: np.ndarray | float = 0.0, lost: tuple[str, ...] = (), age_ns: int = 0, start_ns: int | None = NOW
) -> AnimatorState:
    """The true pose of the demo's person at 5 s, moved, that is captured at a time."""
    motion = simulated_motion(demo_rig("both"))
    true = truth(motion.person, motion.pose_at(5.0)).ten_part_pose()
    pose, captured_ns = Pose(true.position + move, true.angles), NOW + round(1e9 * time_s)
    actor = ActorPose(1, captured_ns, NOW - age_ns, "two-view", TEN_PARTS, true_bdp(motion.person), pose, lost)
    return AnimatorState(now_ns=NOW, actors={"two-view": actor}, start_ns=start_ns)


def shown(time_s: float, move: np.ndarray | float = 0.0, **state: object) -> dict[str, float]:
    return distances(simulated_motion(demo_rig("both")), state_of(time_s, move, **state))


def test_the_true_pose_is_near_and_a_moved_one_as_far_as_it_was_moved() -> None:
    near_m, far_m = (shown(5.0, move)["two-view"] for move in (0.0, MOVED_M))
    assert near_m < 0.03  # the ten parts are no skeleton
    assert abs(far_m - 0.5) <= near_m
    assert shown(12.0)["two-view"] > 0.1  # of another time


@pytest.mark.parametrize("changed", [{"time_s": 1.0}, {"time_s": -1.0}, {"lost": ("person",)}, {"age_ns": 10**9}])
def test_there_is_none_of_an_empty_scene_a_lost_person_and_a_pose_that_is_old(changed: dict[str, object]) -> None:
    assert shown(**{"time_s": 5.0} | changed) == {}


@pytest.mark.parametrize("sources", [(Actor("demo", 0), Actor("demo", 5)), (Actor("wlak", 0), Actor("wlak", 0))])
def test_a_rig_whose_cameras_differ_or_of_an_unknown_motion_has_none(sources: tuple[Actor, Actor]) -> None:
    viewers = [replace(one, source=source) for one, source in zip(demo_rig("both").viewers, sources, strict=True)]
    assert simulated_motion(replace(demo_rig("both"), viewers=tuple(viewers))) is None


def test_frame_0_is_that_of_the_rigs_viewers_and_unknown_before_they_send_it() -> None:
    one, other = demo_rig("both").viewers
    state = after(camera_info(one, NOW - 5), camera_info(replace(other, id="stranger"), NOW - 9))
    assert (after().start_ns, state.start_ns) == (None, NOW - 5)
    assert shown(5.0, start_ns=None) == {}
