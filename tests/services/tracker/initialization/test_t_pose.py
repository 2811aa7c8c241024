"""T-pose: detection in clean and cluttered scenes, rejection of other poses, heading."""

import numpy as np
import pytest

from tests.support.tracker_ring import FRAME_NS, rendered_masks, ring, seen, setup, simulated_person, t_pose_at
from zenocap.common.arrays import Floats32, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.hull.contour_rays import FAR, NEAR
from zenocap.services.tracker.initialization.localization import TPose, detect_t_pose
from zenocap.services.tracker.initialization.t_pose import TPoseFit, await_person, fit_t_poses
from zenocap.services.tracker.parameters import T_POSE_FRAMES, T_POSE_HOLD
from zenocap.services.tracker.states import AwaitingPerson
from zenocap.simulation.body.pose import PersonPose, Placement, neutral, place
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.postures import posture

HELD = residual_weights(setup(ring(2)), T_POSE_HOLD)
YAWS = (0.1, 1.2, 2.9)


def rays_of(seed: int, pose: PersonPose | None, views: int = 4) -> Floats32:
    cameras = ring(views)
    return seen(cameras, list(rendered_masks(cameras, seed, pose).values())).rays


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2, 5])
@pytest.mark.parametrize("yaw", YAWS)
def test_t_pose_is_detected_in_any_heading(seed: int, yaw: float) -> None:
    found = detect_t_pose(rays_of(seed, t_pose_at(seed, 0.3, -0.2, yaw)))
    assert isinstance(found, TPose)
    assert np.linalg.norm(found.centre - [0.3, -0.2]) < 0.1
    assert abs(float(found.across @ [np.cos(yaw), -np.sin(yaw)])) > np.cos(np.radians(10.0))
    assert found.stature == pytest.approx(simulated_person(seed).height, rel=0.08)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("pose", "words"),
    [(None, "waiting for a person"), (neutral(simulated_person(1)), "no T-pose: hold both arms out sideways")],
)
def test_text_names_what_is_missing(pose: PersonPose | None, words: str) -> None:
    found = detect_t_pose(rays_of(1, pose))
    assert isinstance(found, str)
    assert found.startswith(words)


@pytest.mark.nightly
def test_small_object_is_not_a_person() -> None:
    rays = rays_of(1, neutral(simulated_person(1)))
    rays[:3] *= 0.3
    rays[NEAR : FAR + 1] *= 0.3
    found = detect_t_pose(rays)
    assert isinstance(found, str)
    assert "waiting for a person of 0.8 to 2.4 m" in found


def cluttered(masks: dict[str, Mask]) -> list[Mask]:
    """Objects beside and behind the person in every view, and one at the feet."""
    spoilt = []
    for k, mask in enumerate(masks.values()):
        spoilt.append(mask.copy())
        height, width = mask.shape
        spoilt[-1][height // 3 : height // 2, (20 + 50 * k) % width : (50 + 50 * k) % width] = 1
        bottom = int(np.flatnonzero(mask.any(axis=1)).max())
        spoilt[-1][bottom - 3 : bottom + 3, width // 4 : 3 * width // 4] = 1
    return spoilt


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_t_pose_is_measured_among_clutter(seed: int) -> None:
    cameras = ring(4)
    evidence = seen(cameras, cluttered(rendered_masks(cameras, seed, t_pose_at(seed, 0.3, -0.2, 0.3))))
    found = detect_t_pose(evidence.rays)
    assert isinstance(found, TPose)
    assert np.linalg.norm(found.centre - [0.3, -0.2]) < 0.15
    start = fit_t_poses(FOURTEEN_PARTS, [evidence], [found], HELD)
    assert isinstance(start, TPoseFit)
    hip = truth(simulated_person(seed), t_pose_at(seed, 0.3, -0.2, 0.3)).joints["Hip"]
    assert np.linalg.norm(start.poses[0].position - hip) < 0.12


@pytest.mark.nightly
@pytest.mark.parametrize("views", [3, 7])
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_heading_is_resolved(seed: int, views: int) -> None:
    cameras = ring(views)
    for yaw in YAWS:
        evidence = seen(cameras, list(rendered_masks(cameras, seed, t_pose_at(seed, yaw=yaw)).values()))
        found = detect_t_pose(evidence.rays)
        assert isinstance(found, TPose)
        start = fit_t_poses(FOURTEEN_PARTS, [evidence], [found], HELD)
        assert isinstance(start, TPoseFit)
        front = start.poses[0].rotation[:, 2]
        assert float(front @ [np.sin(yaw), 0.0, np.cos(yaw)]) > 0.9, yaw


@pytest.mark.nightly
def test_two_views_tell_the_direction_of_the_arms_and_mostly_the_front() -> None:
    """Each view has the arms in two places of the visual hull.  The feet are a few pixels: the front may be wrong."""
    cameras, arm, right = ring(2), FOURTEEN_PARTS.index["right_upper_arm"], 0
    yaws = np.radians([0, 40, 130, 230, 320])
    for yaw in yaws:
        evidence = seen(cameras, list(rendered_masks(cameras, 2, t_pose_at(2, yaw=float(yaw))).values()))
        found = detect_t_pose(evidence.rays)
        assert isinstance(found, TPose)
        start = fit_t_poses(FOURTEEN_PARTS, [evidence], [found], HELD)
        assert isinstance(start, TPoseFit), start
        forward = float(start.poses[0].rotation[:, 2] @ [np.sin(yaw), 0.0, np.cos(yaw)])
        assert abs(forward) > 0.9, yaw
        assert start.measured.body.sizes[arm, 0] == pytest.approx(simulated_person(2).lengths.upper_arm, rel=0.25)
        right += forward > 0.0
    assert right >= len(yaws) - 1


@pytest.mark.nightly
def test_other_postures_are_not_measured() -> None:
    cameras = ring(4)
    arms = neutral(simulated_person(1)).arms.copy()
    arms[:, 0], arms[:, 3] = np.radians(90.0), np.radians(90.0)  # elbows bent to the front
    bent = t_pose_at(1)
    evidence = seen(cameras, list(rendered_masks(cameras, 1, type(bent)(**{**vars(bent), "arms": arms})).values()))
    found = detect_t_pose(evidence.rays)
    if isinstance(found, TPose):
        start = fit_t_poses(FOURTEEN_PARTS, [evidence], [found], HELD)
        assert isinstance(start, str)
        assert "degrees off" in start or "no body fits" in start
    else:
        assert found.startswith("no T-pose: hold both arms out sideways")


@pytest.mark.nightly
def test_t_pose_is_detected_at_the_edge_of_the_volume() -> None:
    found = detect_t_pose(rays_of(1, place(t_pose_at(1), Placement(1.2, -1.0, 0.4)), views=7))
    assert isinstance(found, TPose)
    assert np.linalg.norm(found.centre - [1.2, -1.0]) < 0.1


def test_who_crouches_with_arms_spread_is_not_in_the_t_pose() -> None:
    squat = posture(simulated_person(1), "squat-arms-sideways", 0)
    lowest = max((squat.pose_at(0.1 * k) for k in range(int(10 * squat.duration_s))), key=lambda pose: pose.pelvis[2])
    found = detect_t_pose(rays_of(1, place(lowest, Placement(0.3, -0.2, 0.3))))
    assert found == "no T-pose: stand upright with both arms out sideways"


def test_who_sinks_with_arms_spread_is_not_measured() -> None:
    cameras, phase = ring(4), AwaitingPerson()
    evidence = seen(cameras, list(rendered_masks(cameras, 1, t_pose_at(1, 0.3, -0.2, 0.3)).values()))
    for k, scale in enumerate([1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82]):
        scaled = evidence.rays.copy()
        scaled[:3] *= scale
        scaled[NEAR : FAR + 1] *= scale
        after, _ = await_person(setup(cameras), phase, k * FRAME_NS, evidence._replace(rays=scaled))
        assert isinstance(after, AwaitingPerson)
        assert len(after.t_poses) < T_POSE_FRAMES
        phase = after
