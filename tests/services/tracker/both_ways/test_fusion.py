"""Fusion of two directions: least cost, symmetric in time, missing poses."""

from itertools import product

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
from zenocap.services.tracker.filter.confidence import Confidence

FRAME_NS = 33_333_333
D = coordinates_of(FOURTEEN_PARTS).dimension
few_examples = settings(max_examples=15)


def pose(random: np.random.Generator, spread: float = 0.3) -> RootedPose:
    turn = euler_to_matrix("yxz", random.normal(0, spread, 3))
    return RootedPose(random.normal(0, spread, 3), np.ascontiguousarray(turn), random.normal(0, spread, D))


def frames(seed: int, count: int, gaps: bool = False) -> list[fusion.TwoPoses]:
    random = np.random.default_rng(seed)
    found = []
    for k in range(count):
        missing = int(random.integers(6)) if gaps else 5
        forward, backward = (None if missing == side else pose(random) for side in (0, 1))
        found.append(fusion.TwoPoses(k * FRAME_NS, forward, backward, random.uniform(0, 2e-3, fusion.CHOICES)))
    return found


def total(sequence: list[fusion.TwoPoses], choices: np.ndarray) -> float:
    cost = sum(fusion._frame_cost(frame)[choice] for frame, choice in zip(sequence, choices, strict=True))
    for before, now, i, j in zip(sequence, sequence[1:], choices, choices[1:], strict=False):
        table = fusion._change_costs(FOURTEEN_PARTS, before, now, 1.0)
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


@pytest.mark.parametrize("stated", [(0.9, 0.2), (0.2, 0.9), (None, 0.9)])
def test_a_limb_is_of_the_direction_that_states_it_more_probable(stated: tuple[float | None, float | None]) -> None:
    random = np.random.default_rng(0)
    start = pose(random)
    sides = [start, start._replace(values=start.values + 0.1)]
    both = [Confidence({} if one is None else {"left_arm": one}, None) for one in stated]
    sequence = [fusion.TwoPoses(k * FRAME_NS, *sides, np.full(fusion.CHOICES, 1e-4), *both) for k in range(3)]
    taken = fusion.BACKWARD[fusion.best_choices(FOURTEEN_PARTS, sequence, FRAME_NS)].any(axis=0)
    expected = dict.fromkeys(fusion.SECTIONS, False) | {"left_arm": stated == (0.2, 0.9)}
    assert dict(zip(fusion.SECTIONS, taken.tolist(), strict=True)) == expected


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


def test_a_limb_that_fits_better_backwards_is_taken_from_there_and_nothing_else() -> None:
    rest = RootedPose(np.zeros(3), np.eye(3), np.zeros(D))
    wrong, arm = rest.copy(), fusion.SECTIONS.index("left_arm")
    wrong.values[fusion.columns_of(FOURTEEN_PARTS)[arm]] += 1.5
    sequence = []
    for k in range(30):
        bad = 10 <= k < 20
        misfits = np.where(fusion.BACKWARD[:, arm] | (not bad), 1e-4, 2e-3) + 1e-5 * fusion.BACKWARD.sum(axis=1)
        sequence.append(fusion.TwoPoses(k * FRAME_NS, wrong if bad else rest, rest, misfits))
    found = list(fusion.fused(FOURTEEN_PARTS, sequence, FRAME_NS))
    for k, (one, shares) in enumerate(found):
        np.testing.assert_allclose(one.values, 0.0, atol=1e-12)
        assert shares[arm] == (1.0 if 10 <= k < 20 else shares[arm])
        np.testing.assert_array_equal(np.delete(shares, arm), 0.0)
    assert found[0][1][arm] == found[-1][1][arm] == 0.0


def test_frames_with_a_pose_in_one_direction_have_that_pose() -> None:
    sequence = frames(5, 12, gaps=True)
    for frame, (found, shares) in zip(sequence, fusion.fused(FOURTEEN_PARTS, sequence, FRAME_NS), strict=True):
        if frame.forward is None or frame.backward is None:
            assert found is (frame.backward or frame.forward)
            assert set(shares.tolist()) == {0.0 if frame.backward is None else 1.0}
