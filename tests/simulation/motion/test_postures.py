"""Every posture shows the movement of its name, for several people and repetitions."""

import numpy as np
import pytest

from tests.support.joint_paths import joint_paths
from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import unit
from zenocap.simulation.body.person import person
from zenocap.simulation.body.rotation import ry
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.postures import POSTURES, posture

PEOPLE = [(1, 0), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((4, 3), (9, 7), (23, 2)))]
each_repetition = pytest.mark.parametrize(("seed", "repetition"), PEOPLE)
RAISED = {"raise-right-arm": "R", "raise-left-arm": "L", "raise-both-arms": "RL"}
SWUNG = {"swing-right-arm": "R", "swing-left-arm": "L", "swing-both-arms": "RL"}
KICKED = {"kick-right": "R", "kick-left": "L", "kick-right-arms-sideways": "R"}


def paths_of(name: str, seed: int, repetition: int) -> dict[str, Floats]:
    """(frames, 3) of every joint at 30 frames a second, scaled to a person of 1.7 m."""
    subject = person(seed)
    paths = joint_paths(subject, posture(subject, name, repetition), step_s=1 / 30)
    return {joint: 1.7 / subject.height * path for joint, path in paths.items()}


def test_error_for_an_unknown_posture_lists_the_fifteen_known_ones() -> None:
    assert len(set(POSTURES)) == 15
    with pytest.raises(ValueError, match=r"'dance' is not one of march, .*kick-left"):
        posture(person(0), "dance", 0)


@pytest.mark.parametrize("name", POSTURES)
def test_repetitions_differ_and_are_repeatable(name: str) -> None:
    subject = person(4)
    once, again, other = (posture(subject, name, seed) for seed in (1, 1, 2))
    wrists = [truth(subject, motion.pose_at(1.0)).joints["RWrist"] for motion in (once, again, other)]
    assert np.array_equal(wrists[0], wrists[1])
    assert once.duration_s == again.duration_s
    assert once.duration_s != other.duration_s
    assert not np.array_equal(wrists[0], wrists[2])


@pytest.mark.parametrize("name", POSTURES)
@each_repetition
def test_posture_lasts_about_forty_frames_and_starts_and_ends_neutral(name: str, seed: int, repetition: int) -> None:
    subject = person(seed)
    motion = posture(subject, name, repetition)
    assert 2.2 < motion.duration_s < 3.3
    start, end = (truth(subject, motion.pose_at(t)) for t in (0.0, motion.duration_s))
    for segment, direction in start.directions.items():
        turned = end.directions[segment] @ ry(end.yaw) @ direction
        assert np.degrees(np.arccos(min(turned, 1.0))) < 8.0, segment
        assert direction[1] < -0.9


@pytest.mark.parametrize(("name", "sides"), RAISED.items())
@each_repetition
def test_raising_lifts_the_named_wrists_sideways_above_the_shoulders(
    name: str, sides: str, seed: int, repetition: int
) -> None:
    joints = paths_of(name, seed, repetition)
    for side in "RL":
        arm = joints[f"{side}Wrist"] - joints[f"{side}Shoulder"]
        if side in sides:
            assert arm[:, 1].max() > 0.2
            assert np.abs(arm[:, 0]).max() > 0.4
            assert np.abs(arm[:, 2]).max() < 0.20
        else:
            assert arm[:, 1].max() < -0.35


@each_repetition
def test_raising_both_arms_bent_folds_both_elbows_in_the_frontal_plane(seed: int, repetition: int) -> None:
    joints = paths_of("raise-both-arms-bent", seed, repetition)
    for side in "RL":
        top = int(np.argmax(joints[f"{side}Wrist"][:, 1]))
        shoulder, elbow, wrist = (joints[side + name][top] for name in ("Shoulder", "Elbow", "Wrist"))
        lower = wrist - elbow
        assert np.degrees(np.arccos(unit(elbow - shoulder) @ unit(lower))) > 50.0
        assert lower[1] > 0.12
        assert abs(lower[2]) < 0.15


@pytest.mark.parametrize(("name", "sides"), SWUNG.items())
@each_repetition
def test_swinging_carries_the_named_wrists_forward_in_the_sagittal_plane(
    name: str, sides: str, seed: int, repetition: int
) -> None:
    joints = paths_of(name, seed, repetition)
    for side in "RL":
        arm = joints[f"{side}Wrist"] - joints[f"{side}Shoulder"]
        if side in sides:
            assert arm[:, 2].max() > 0.4
            assert np.abs(arm[:, 0]).max() < 0.25
        else:
            assert arm[:, 2].max() < 0.25


@pytest.mark.parametrize("name", ["squat", "squat-arms-sideways", "squat-arms-forward"])
@each_repetition
def test_squatting_lowers_the_hip_over_planted_feet(name: str, seed: int, repetition: int) -> None:
    joints = paths_of(name, seed, repetition)
    assert np.ptp(joints["Hip"][:, 1]) > 0.14
    low = int(np.argmin(joints["Hip"][:, 1]))
    for side in "RL":
        assert np.ptp(joints[f"{side}Ankle"], axis=0).max() < 2e-3
        arm = (joints[f"{side}Wrist"] - joints[f"{side}Shoulder"])[low]
        if name == "squat":
            assert arm[1] < -0.35
        elif name == "squat-arms-sideways":
            assert abs(arm[0]) > 0.35
            assert abs(arm[1]) < 0.2
        else:
            assert arm[2] > 0.35
            assert abs(arm[1]) < 0.2


@pytest.mark.parametrize(("name", "side"), KICKED.items())
@each_repetition
def test_kicking_swings_the_named_foot_forwards_and_leaves_the_other(
    name: str, side: str, seed: int, repetition: int
) -> None:
    joints = paths_of(name, seed, repetition)
    foot, hip = joints[f"{side}Ankle"], joints["Hip"]
    other = joints[f"{'L' if side == 'R' else 'R'}Ankle"]
    assert (foot - hip)[:, 2].max() > 0.35
    assert (foot - hip)[:, 2].min() < -0.12
    assert np.ptp(foot[:, 1]) > 0.2
    assert np.ptp(other, axis=0).max() < 2e-3
    high = int(np.argmax(foot[:, 1]))
    spread = np.linalg.norm(joints["RWrist"] - joints["LWrist"], axis=1)[high]
    assert (spread > 1.2) == (name == "kick-right-arms-sideways")


@each_repetition
def test_marching_lifts_both_knees_in_turn_on_the_spot(seed: int, repetition: int) -> None:
    joints = paths_of("march", seed, repetition)
    for side in "RL":
        assert np.ptp(joints[f"{side}Knee"][:, 1]) > 0.12
    both = np.minimum(joints["RAnkle"][:, 1], joints["LAnkle"][:, 1])
    assert both.max() < both.min() + 0.04
    assert np.ptp(joints["Hip"][:, 2]) < 0.05


@each_repetition
def test_turn_and_walk_turns_a_quarter_to_the_left_and_walks_off(seed: int, repetition: int) -> None:
    subject = person(seed)
    motion = posture(subject, "turn-and-walk", repetition)
    last = truth(subject, motion.pose_at(motion.duration_s))
    assert 75.0 < np.degrees(last.yaw) < 105.0
    assert 0.6 < last.joints["Hip"][0] < 1.6
    assert motion.end.x == pytest.approx(last.joints["Hip"][0], abs=0.05)
