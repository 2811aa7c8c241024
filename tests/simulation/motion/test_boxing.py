"""Boxing: fists extend and return to the guard, the boxer stays in place, each seed differs."""

import numpy as np
import pytest

from tests.support.joint_paths import joint_paths
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import LEFT
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.boxing import box
from zenocap.simulation.motion.boxing_moves import AREA_M, PUNCHES, boxing_moves, boxing_style

DURATION_S = 14.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_straight_punches_extend_the_arm_forwards(seed: int) -> None:
    subject = person(1)
    motion, lead = box(subject, DURATION_S, seed), boxing_style(subject.seed).lead
    arm = subject.lengths.upper_arm + subject.lengths.forearm
    straight = [move for move in boxing_moves(subject, DURATION_S, seed) if move.name in ("jab", "cross")]
    assert straight
    for move in straight:
        letter = "RL"[lead] if move.name == "jab" else "RL"[1 - lead]
        joints = landmarks(subject, motion.pose_at(move.start_s + 0.42 * move.duration_s))
        assert (joints[f"{letter}Wrist"] - joints[f"{letter}Shoulder"])[2] > 0.6 * arm, move


@pytest.mark.slow
def test_fists_guard_the_face_between_punches() -> None:
    subject = person(4)
    motion, moves = box(subject, DURATION_S, 3), boxing_moves(subject, DURATION_S, 3)
    busy = [(m.start_s, m.start_s + m.duration_s) for m in moves if m.name in PUNCHES]
    quiet = [t for t in np.arange(1.2, DURATION_S - 1.2, 0.1) if not any(a <= t <= b for a, b in busy)]
    assert len(quiet) > 10
    for t in quiet:
        joints = landmarks(subject, motion.pose_at(float(t)))
        for letter in "RL":
            assert np.linalg.norm(joints[f"{letter}Wrist"] - joints["Head"]) < 0.55
            assert joints[f"{letter}Wrist"][1] > joints[f"{letter}Elbow"][1]


@pytest.mark.nightly
def test_the_boxer_stays_near_and_ends_standing_at_the_origin() -> None:
    subject = person(7)
    motion = box(subject, DURATION_S, 5)
    assert np.abs(joint_paths(subject, motion, step_s=0.1)["Hip"][:, [0, 2]]).max() < AREA_M + 0.25
    last = landmarks(subject, motion.pose_at(DURATION_S))
    assert np.abs(last["Hip"][[0, 2]]).max() < 0.02
    assert np.abs((last["RAnkle"] + last["LAnkle"])[[0, 2]]).max() < 0.02


def test_equal_seeds_give_equal_orders_of_moves_and_other_seeds_others() -> None:
    orders = [[m.name for m in boxing_moves(person(0), 20.0, seed)] for seed in (0, 0, 1, 2)]
    assert orders[0] == orders[1]
    assert orders[0] != orders[2] != orders[3]
    assert {name for seed in range(20) for name in (m.name for m in boxing_moves(person(0), 20.0, seed))} >= {*PUNCHES}
    assert [boxing_style(seed).lead for seed in range(40)].count(LEFT) > 25


def test_too_short_duration_is_rejected() -> None:
    with pytest.raises(ValueError, match=r"duration_s = 3\.0: allowed: 4 or more"):
        box(person(0), 3.0, 0)
