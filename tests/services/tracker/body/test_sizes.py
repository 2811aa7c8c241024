"""Sizes as factors on an average body."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.services.tracker.body import sizes
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import model_of


def grown(anatomy: Anatomy, name: str, times: float = 1.3) -> tuple[Bdp, Bdp]:
    """Average body, and the same with one factor."""
    logs = np.zeros(sizes.COUNT)
    logs[sizes.SIZE_NAMES.index(name)] = np.log(times)
    average = average_body(anatomy, 1.75)
    return sizes.scaled(anatomy, average, np.zeros(sizes.COUNT)), sizes.scaled(anatomy, average, logs)


@each_anatomy
def test_stature_scales_everything_and_zero_logs_nothing(anatomy: Anatomy) -> None:
    same, taller = grown(anatomy, "stature", 1.2)
    for before, after in zip(model_of(anatomy, average_body(anatomy, 1.75)), model_of(anatomy, same), strict=True):
        np.testing.assert_array_equal(before, after)
    other = average_body(anatomy, 1.2 * 1.75)
    assert taller.sizes == pytest.approx(other.sizes)
    assert taller.offsets == pytest.approx(other.offsets)


@each_anatomy
@pytest.mark.parametrize("name", sizes.SIZE_NAMES[1:])
def test_factor_multiplies_its_entries_and_nothing_else(anatomy: Anatomy, name: str) -> None:
    before, after = grown(anatomy, name)
    rows = sizes.entries_of(anatomy)
    mine = rows[:, 0] == sizes.SIZE_NAMES.index(name)
    old, new = sizes.values_of(anatomy, before), sizes.values_of(anatomy, after)
    at = [tuple(row) for row in rows[mine, 1:].tolist()]
    theirs = np.array([tuple(row) in at for row in rows[:, 1:].tolist()], dtype=bool)
    assert new[theirs] == pytest.approx(1.3 * old[theirs])
    assert np.array_equal(new[~theirs], old[~theirs])


def test_every_size_belongs_to_a_factor() -> None:
    """Every length, radius and joint offset that is not zero; of the ten parts the radii."""
    known = {tuple(row) for row in sizes.entries_of(FOURTEEN_PARTS)[:, 1:].tolist()}
    for part in range(len(FOURTEEN_PARTS.parts)):
        assert {(sizes.SIZES, part, column) for column in range(3)} <= known
        assert {(sizes.TIPS, part, column) for column in range(2)} <= known
    offsets = average_body(FOURTEEN_PARTS, 1.75).offsets
    assert {(sizes.OFFSETS, joint, column) for joint, column in np.argwhere(offsets != 0.0).tolist()} <= known
    known = {tuple(row) for row in sizes.entries_of(TEN_PARTS)[:, 1:].tolist()}
    radii = {(sizes.SIZES, part, column) for part in range(10) for column in (sizes.LONG, sizes.SHORT)}
    assert known == radii | {(sizes.TIPS, part, column) for part in range(10) for column in range(2)}


def test_ten_parts_remain_cylinders() -> None:
    rng = np.random.default_rng(0)
    body = sizes.scaled(TEN_PARTS, average_body(TEN_PARTS, 1.75), rng.normal(scale=sizes.SPREADS))
    assert body.tips == pytest.approx(body.sizes[:, 1:])
    assert set(sizes.CYLINDERS) | set(sizes.SHARED) <= set(sizes.SIZE_NAMES)
    assert not set(sizes.CYLINDERS) & set(sizes.SHARED)


@each_anatomy
def test_limb_joints_remain_at_the_ends_of_the_parts(anatomy: Anatomy) -> None:
    body = sizes.scaled(anatomy, average_body(anatomy, 1.75), np.random.default_rng(1).normal(scale=sizes.SPREADS))
    index = anatomy.index
    for part, joint in (("right_upper_arm", "right_elbow"), ("left_upper_leg", "left_knee")):
        assert body.offsets[index[joint], 1] == pytest.approx(body.sizes[index[part], 0])
