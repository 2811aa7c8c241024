"""Boxing: fists go out and come back to the guard, the boxer stays in place, and each seed boxes another way."""

import numpy as np
import pytest

from common.actor.boxing import box
from common.actor.boxing_moves import AREA_M, PUNCHES, boxing_manner, boxing_moves
from common.actor.person import person
from common.actor.pose import LEFT
from common.actor.truth import landmarks

DURATION_S = 14.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_straight_punch_stretches_its_arm_to_the_front(seed: int) -> None:
    someone = person(1)
    motion, lead = box(someone, DURATION_S, seed), boxing_manner(someone.seed).lead
    arm = someone.lengths.upper_arm + someone.lengths.forearm
    seen = 0
    for move in boxing_moves(someone, DURATION_S, seed):
        if move.name in ("jab", "cross"):
            letter = "RL"[lead] if move.name == "jab" else "RL"[1 - lead]
            joints = landmarks(someone, motion.pose_at(move.start_s + 0.42 * move.duration_s))
            out = joints[f"{letter}Wrist"] - joints[f"{letter}Shoulder"]
            assert out[2] > 0.6 * arm, move
            seen += 1
    assert seen > 0


def test_the_guard_is_before_the_face_when_nothing_is_thrown() -> None:
    someone = person(4)
    motion, moves = box(someone, DURATION_S, 3), boxing_moves(someone, DURATION_S, 3)
    busy = [(m.start_s, m.start_s + m.duration_s) for m in moves if m.name in PUNCHES]
    quiet = [t for t in np.arange(1.2, DURATION_S - 1.2, 0.1) if not any(a <= t <= b for a, b in busy)]
    assert len(quiet) > 10
    for t in quiet:
        joints = landmarks(someone, motion.pose_at(float(t)))
        for letter in "RL":
            assert np.linalg.norm(joints[f"{letter}Wrist"] - joints["Head"]) < 0.55
            assert joints[f"{letter}Wrist"][1] > joints[f"{letter}Elbow"][1]


def test_the_boxer_stays_near_and_ends_standing_at_the_origin() -> None:
    someone = person(7)
    motion = box(someone, DURATION_S, 5)
    for t in np.arange(0.0, DURATION_S, 0.1):
        hip = landmarks(someone, motion.pose_at(float(t)))["Hip"]
        assert np.abs(hip[[0, 2]]).max() < AREA_M + 0.25
    last = landmarks(someone, motion.pose_at(DURATION_S))
    assert np.abs(last["Hip"][[0, 2]]).max() < 0.02
    assert np.abs((last["RAnkle"] + last["LAnkle"])[[0, 2]]).max() < 0.02


def test_no_joint_jumps() -> None:
    someone = person(2)
    motion = box(someone, DURATION_S, 2)
    frames = [landmarks(someone, motion.pose_at(float(t))) for t in np.arange(0.0, DURATION_S, 0.02)]
    points = np.array([list(frame.values()) for frame in frames])
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() / 0.02 < 11.0


def test_seeds_draw_other_orders_and_the_same_seed_the_same() -> None:
    orders = [[m.name for m in boxing_moves(person(0), 20.0, seed)] for seed in (0, 0, 1, 2)]
    assert orders[0] == orders[1]
    assert orders[0] != orders[2] != orders[3]
    assert {name for seed in range(20) for name in (m.name for m in boxing_moves(person(0), 20.0, seed))} >= {*PUNCHES}
    assert [boxing_manner(seed).lead for seed in range(40)].count(LEFT) > 25


def test_a_bout_too_short_is_refused() -> None:
    with pytest.raises(ValueError, match=r"duration_s = 3\.0: allowed: 4 or more"):
        box(person(0), 3.0, 0)
