"""Candidates for labelling: every movement between two rests."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.training.labelling import Candidate, candidates_of
from zenocap.services.recognizer.training.parameters import HOLD_S, LEAST_REACH

RATE = 30.0


def still(seconds: float, seed: int = 0, tremble: float = 0.005) -> Floats:
    return np.random.default_rng(seed).normal(scale=tremble, size=(round(seconds * RATE), len(NAMES)))


def found_in(motion: Floats) -> list[Candidate]:
    return candidates_of(times(motion), motion, RATE)


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
    parts, spans = [still(1.5)], []
    for k, name in enumerate(names):
        begin = sum(map(len, parts)) / RATE
        parts += [pulse(1.6, name, 1.5), still(1.2, k)]
        spans.append((begin, begin + 1.6))
    found = found_in(np.concatenate(parts))
    assert [one.limbs for one in found] == [("right arm",), ("left arm",), ("right leg",)]
    np.testing.assert_allclose([(one.start_s, one.end_s) for one in found], spans, rtol=0.0, atol=0.3)
    np.testing.assert_allclose([one.reach for one in found], 1.5, rtol=0.0, atol=0.15)


@pytest.mark.parametrize(("hold_s", "count"), [(0.7 * HOLD_S, 1), (2.0 * HOLD_S, 2)])
def test_a_short_hold_does_not_split_a_movement(hold_s: float, count: int) -> None:
    motion = np.concatenate([still(1), pulse(1.6, "left_shoulder.z", 2.0, hold_s), still(1)])
    assert len(found_in(motion)) == count


def test_a_candidate_has_the_limbs_that_move_and_no_others() -> None:
    both = pulse(2.0, "right_shoulder.x", 1.5) + pulse(2.0, "left_shoulder.x", 1.2) + pulse(2.0, "left_hip.x", 0.2)
    assert [one.limbs for one in found_in(np.concatenate([still(1), both, still(1)]))] == [("right arm", "left arm")]


SMALL = np.concatenate([still(2, tremble=0.02), pulse(1.0, "right_elbow.x", 0.7 * LEAST_REACH), still(2, 1, 0.02)])


@pytest.mark.parametrize(
    "motion",
    [SMALL, *(np.zeros((rows, len(NAMES))) for rows in (0, 1, 2)), np.full((90, len(NAMES)), np.nan)],
    ids=["trembling and small", "no frames", "one frame", "two frames", "without a person"],
)
def test_motions_without_candidates(motion: Floats) -> None:
    assert found_in(motion) == []


def test_a_gap_ends_a_candidate_and_no_candidate_has_unknown_frames() -> None:
    motion = np.concatenate([still(1), pulse(3.0, "right_shoulder.x", 2.5), still(1)])
    motion[round(2.3 * RATE) : round(2.7 * RATE)] = np.nan
    found = found_in(motion)
    assert len(found) == 2
    for one in found:
        rows = (times(motion) >= one.start_s) & (times(motion) <= one.end_s)
        assert np.isfinite(motion[rows]).all()


@pytest.mark.slow
@given(seed=st.integers(0, 10_000), gaps=st.integers(0, 4))
@settings(deadline=None, max_examples=60)
def test_candidates_are_ordered_disjoint_and_within_the_motion(seed: int, gaps: int) -> None:
    rng = np.random.default_rng(seed)
    motion = np.cumsum(rng.normal(scale=rng.uniform(0.0, 0.15), size=(rng.integers(3, 400), len(NAMES))), axis=0)
    for _ in range(gaps):
        at = int(rng.integers(len(motion)))
        motion[at : at + int(rng.integers(1, 20))] = np.nan
    found = found_in(motion)
    edges = [edge for one in found for edge in (one.start_s, one.end_s)]
    assert edges == sorted(edges)
    for one in found:
        assert 0.0 <= one.start_s < one.end_s <= times(motion)[-1]
        assert one.limbs
