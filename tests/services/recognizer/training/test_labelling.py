"""Candidates for labelling: every movement between two rests."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.training.labelling import HOLD_S, LEAST_REACH, candidates_of

RATE = 30.0


def still(seconds: float, seed: int = 0, tremble: float = 0.005) -> Floats:
    return np.random.default_rng(seed).normal(scale=tremble, size=(round(seconds * RATE), len(NAMES)))


def times(features: Floats) -> Floats:
    return np.arange(len(features)) / RATE


def pulse(seconds: float, name: str, reach: float, hold_s: float = 0.0) -> Floats:
    """A movement up, a hold, and the way back."""
    up = 0.5 * reach * (1 - np.cos(np.linspace(0, np.pi, round(seconds / 2 * RATE))))
    profile = np.concatenate([up, np.full(round(hold_s * RATE), reach), up[::-1]])
    moved = np.zeros((len(profile), len(NAMES)))
    moved[:, NAMES.index(name)] = profile
    return moved


def test_every_movement_between_rests_is_one_candidate() -> None:
    names = ("right_shoulder.x", "left_shoulder.z", "right_hip.x")
    parts = [still(1.5)]
    spans = []
    for k, name in enumerate(names):
        begin = sum(map(len, parts)) / RATE
        parts += [pulse(1.6, name, 1.5), still(1.2, k)]
        spans.append((begin, begin + 1.6))
    motion = np.concatenate(parts)
    found = candidates_of(times(motion), motion, RATE)
    assert [one.limbs for one in found] == [("right arm",), ("left arm",), ("right leg",)]
    for one, (begin, end) in zip(found, spans, strict=True):
        assert one.start_s == pytest.approx(begin, abs=0.3)
        assert one.end_s == pytest.approx(end, abs=0.3)
        assert one.reach == pytest.approx(1.5, abs=0.15)


def test_a_short_hold_does_not_split_a_movement() -> None:
    for hold_s, count in ((0.7 * HOLD_S, 1), (2.0 * HOLD_S, 2)):
        motion = np.concatenate([still(1), pulse(1.6, "left_shoulder.z", 2.0, hold_s), still(1)])
        assert len(candidates_of(times(motion), motion, RATE)) == count


def test_a_candidate_has_the_limbs_that_move_and_no_others() -> None:
    both = pulse(2.0, "right_shoulder.x", 1.5) + pulse(2.0, "left_shoulder.x", 1.2) + pulse(2.0, "left_hip.x", 0.2)
    motion = np.concatenate([still(1), both, still(1)])
    assert [one.limbs for one in candidates_of(times(motion), motion, RATE)] == [("right arm", "left arm")]


def test_trembling_and_small_movements_give_no_candidates() -> None:
    motion = np.concatenate([still(2, tremble=0.02), pulse(1.0, "right_elbow.x", 0.7 * LEAST_REACH), still(2, 1, 0.02)])
    assert candidates_of(times(motion), motion, RATE) == []


def test_a_gap_ends_a_candidate_and_no_candidate_has_unknown_frames() -> None:
    motion = np.concatenate([still(1), pulse(3.0, "right_shoulder.x", 2.5), still(1)])
    gap = slice(round(2.3 * RATE), round(2.7 * RATE))
    motion[gap] = np.nan
    found = candidates_of(times(motion), motion, RATE)
    assert len(found) == 2
    for one in found:
        rows = (times(motion) >= one.start_s) & (times(motion) <= one.end_s)
        assert np.isfinite(motion[rows]).all()


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_too_few_frames_give_no_candidates(rows: int) -> None:
    assert candidates_of(np.arange(rows) / RATE, np.zeros((rows, len(NAMES))), RATE) == []


def test_frames_without_a_person_give_no_candidates() -> None:
    assert candidates_of(np.arange(90) / RATE, np.full((90, len(NAMES)), np.nan), RATE) == []


@pytest.mark.slow
@given(seed=st.integers(0, 10_000), gaps=st.integers(0, 4))
@settings(deadline=None, max_examples=60)
def test_candidates_are_ordered_disjoint_and_within_the_motion(seed: int, gaps: int) -> None:
    rng = np.random.default_rng(seed)
    motion = np.cumsum(rng.normal(scale=rng.uniform(0.0, 0.15), size=(rng.integers(3, 400), len(NAMES))), axis=0)
    for _ in range(gaps):
        at = int(rng.integers(len(motion)))
        motion[at : at + int(rng.integers(1, 20))] = np.nan
    found = candidates_of(times(motion), motion, RATE)
    edges = [edge for one in found for edge in (one.start_s, one.end_s)]
    assert edges == sorted(edges)
    for one in found:
        assert 0.0 <= one.start_s < one.end_s <= times(motion)[-1]
        assert one.limbs
