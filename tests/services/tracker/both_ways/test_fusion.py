"""Fusion of two directions: least cost, symmetric in time, missing poses, held poses."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.both_ways import fusion

FRAME_NS = 33_333_333
D = coordinates_of(FOURTEEN_PARTS).dimension
few_examples = settings(max_examples=15)


def pose(random: np.random.Generator, spread: float = 0.3) -> RootedPose:
    turn = euler_to_matrix("yxz", random.normal(0, spread, 3))
    return RootedPose(random.normal(0, spread, 3), np.ascontiguousarray(turn), random.normal(0, spread, D))


def frames(seed: int, count: int, gaps: bool = False) -> list[fusion.TwoPoses]:
    """Random poses, of which every other one is held."""
    random = np.random.default_rng(seed)
    found: list[fusion.TwoPoses] = []
    for k in range(count):
        missing = int(random.integers(6)) if gaps else 5
        forward, backward = (None if missing == side else pose(random) for side in (0, 1))
        if found and random.integers(2):
            forward, backward = found[-1].forward, found[-1].backward
        found.append(fusion.TwoPoses(k * FRAME_NS, forward, backward, random.uniform(0, 2e-3, fusion.CHOICES)))
    return found


def total(sequence: list[fusion.TwoPoses], choices: np.ndarray) -> float:
    tables = [fusion._change_costs(FOURTEEN_PARTS, *both, FRAME_NS) for both in pairwise(sequence)]
    weights = fusion._weights(tables, FRAME_NS)
    cost = sum(fusion._frame_cost(*one)[choice] for *one, choice in zip(sequence, weights, choices, strict=True))
    for table, i, j in zip(tables, choices, choices[1:], strict=False):
        cost += table[np.arange(len(fusion.SECTIONS)), fusion.BACKWARD[i].astype(int), fusion.BACKWARD[j].astype(int)].sum()
    return float(cost)


@each_anatomy
def test_sections_divide_the_coordinates(anatomy: Anatomy) -> None:
    columns = np.concatenate(fusion.columns_of(anatomy))
    assert sorted(columns.tolist()) == list(range(coordinates_of(anatomy).dimension))
    assert all(len(one) >= 4 for one in fusion.columns_of(anatomy)[1:])


@pytest.mark.nightly
@given(seed=st.integers(0, 1000), gaps=st.booleans())
@few_examples
def test_choices_have_the_least_cost_of_all(seed: int, gaps: bool) -> None:
    sequence = frames(seed, 2, gaps)
    best = min(total(sequence, np.array(both)) for both in product(range(fusion.CHOICES), repeat=2))
    assert total(sequence, fusion.best_choices(FOURTEEN_PARTS, sequence, FRAME_NS)) == pytest.approx(best)


@given(seed=st.integers(0, 1000), gaps=st.booleans())
@few_examples
def test_time_reversed_gives_the_same_choices_in_reverse(seed: int, gaps: bool) -> None:
    sequence = frames(seed, 8, gaps)
    end_ns = sequence[-1].captured_ns
    turned = [
        fusion.TwoPoses(end_ns - one.captured_ns, one.forward, one.backward, one.misfits) for one in reversed(sequence)
    ]
    there, back = (fusion.best_choices(FOURTEEN_PARTS, one, FRAME_NS) for one in (sequence, turned))
    np.testing.assert_array_equal(there, back[::-1])


@given(seed=st.integers(0, 1000), shares=st.lists(st.floats(0, 1), min_size=5, max_size=5))
@few_examples
def test_a_blend_is_the_same_from_either_side(seed: int, shares: list[float]) -> None:
    random = np.random.default_rng(seed)
    one, other, share = pose(random), pose(random), np.array(shares)
    turned = fusion.blended(FOURTEEN_PARTS, other, one, 1 - share)
    for at, expected, tolerance in ((share, turned, 1e-9), (np.zeros(5), one, 1e-12), (np.ones(5), other, 1e-12)):
        for a, b in zip(fusion.blended(FOURTEEN_PARTS, one, other, at), expected, strict=True):
            np.testing.assert_allclose(a, b, atol=tolerance)


def test_equal_directions_give_the_pose_itself() -> None:
    random = np.random.default_rng(3)
    poses = [pose(random) for _ in range(10)]
    same = [fusion.TwoPoses(k * FRAME_NS, one, one, np.full(fusion.CHOICES, 1e-4)) for k, one in enumerate(poses)]
    for (found, _), expected in zip(fusion.fused(FOURTEEN_PARTS, same, FRAME_NS), poses, strict=True):
        np.testing.assert_allclose(found.values, expected.values, atol=1e-12)
        np.testing.assert_allclose(found.rotation, expected.rotation, atol=1e-9)


def walking(k: int, *wrong: int) -> RootedPose:
    """Frame k of a person who moves along X at 0.6 m/s, with wrong sections."""
    found = RootedPose(np.array([0.02 * k, 0.0, 0.0]), np.eye(3), np.zeros(D))
    for section in wrong:
        found.values[fusion.columns_of(FOURTEEN_PARTS)[section]] += 0.7
    return found


def test_a_limb_that_fits_better_backwards_is_taken_from_there_and_nothing_else() -> None:
    arm, sequence = fusion.SECTIONS.index("left_arm"), []
    for k in range(30):
        bad = 10 <= k < 20
        misfits = np.where(fusion.BACKWARD[:, arm] | (not bad), 1e-4, 2e-3) + 1e-5 * fusion.BACKWARD.sum(axis=1)
        forward = walking(k, arm) if bad else walking(k)
        sequence.append(fusion.TwoPoses(k * FRAME_NS, forward, walking(k), misfits))
    found = list(fusion.fused(FOURTEEN_PARTS, sequence, FRAME_NS))
    for k, (one, shares) in enumerate(found):
        np.testing.assert_allclose(one.values, 0.0, atol=1e-12)
        assert shares[arm] == (1.0 if 10 <= k < 20 else shares[arm])
        np.testing.assert_array_equal(np.delete(shares, arm), 0.0)
    assert found[0][1][arm] == found[-1][1][arm] == 0.0


@pytest.mark.parametrize("held", [True, False])
def test_a_held_pose_that_fits_a_little_better_does_not_outweigh_the_jump_at_its_end(held: bool) -> None:
    """Legs exchanged forwards for 60 frames; the same difference in each frame of a motion counts in each."""
    legs, sequence = [fusion.SECTIONS.index(name) for name in ("right_leg", "left_leg")], []
    for k in range(90):
        step = max(0, k - 60) if held else k
        forward = walking(step, *legs) if k < 60 else walking(step)
        misfits = 1e-3 + (k < 60) * 1e-5 * fusion.BACKWARD[:, legs].sum(axis=1)
        sequence.append(fusion.TwoPoses(k * FRAME_NS, forward, walking(step), misfits))
    choices = fusion.BACKWARD[fusion.best_choices(FOURTEEN_PARTS, sequence, FRAME_NS)]
    np.testing.assert_array_equal(choices[:60, legs], held)


def test_frames_with_a_pose_in_one_direction_have_that_pose() -> None:
    sequence = frames(5, 12, gaps=True)
    for frame, (found, shares) in zip(sequence, fusion.fused(FOURTEEN_PARTS, sequence, FRAME_NS), strict=True):
        if frame.forward is None or frame.backward is None:
            assert found is (frame.backward or frame.forward)
            assert set(shares.tolist()) == {0.0 if frame.backward is None else 1.0}
