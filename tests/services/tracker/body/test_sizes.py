"""Sizes as factors on an average body."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import model_of
from zenocap.services.tracker.body.sizes import (  # fmt: skip
    COUNT,
    CYLINDERS,
    LONG,
    OFFSETS,
    SHARED,
    SHORT,
    SIZE_NAMES,
    SIZES,
    SPREADS,
    TIPS,
    entries_of,
    scaled,
    values_of,
)


def grown(anatomy: Anatomy, name: str, times: float = 1.3) -> tuple[Bdp, Bdp]:
    """Average body, and the same with one factor."""
    logs = np.zeros(COUNT)
    logs[SIZE_NAMES.index(name)] = np.log(times)
    average = average_body(anatomy, 1.75)
    return scaled(anatomy, average, np.zeros(COUNT)), scaled(anatomy, average, logs)


@each_anatomy
def test_zero_logs_leave_the_body_unchanged(anatomy: Anatomy) -> None:
    average = average_body(anatomy, 1.75)
    same, _ = grown(anatomy, "stature", 1.0)
    before, after = model_of(anatomy, average), model_of(anatomy, same)
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


@each_anatomy
def test_stature_scales_everything(anatomy: Anatomy) -> None:
    _, taller = grown(anatomy, "stature", 1.2)
    other = average_body(anatomy, 1.2 * 1.75)
    assert taller.sizes == pytest.approx(other.sizes)
    assert taller.offsets == pytest.approx(other.offsets)


@each_anatomy
@pytest.mark.parametrize("name", SIZE_NAMES[1:])
def test_factor_multiplies_its_entries_and_nothing_else(anatomy: Anatomy, name: str) -> None:
    before, after = grown(anatomy, name)
    rows = entries_of(anatomy)
    mine = rows[:, 0] == SIZE_NAMES.index(name)
    old, new = values_of(anatomy, before), values_of(anatomy, after)
    at = [tuple(row) for row in rows[mine, 1:].tolist()]
    theirs = np.array([tuple(row) in at for row in rows[:, 1:].tolist()], dtype=bool)
    assert new[theirs] == pytest.approx(1.3 * old[theirs])
    assert np.array_equal(new[~theirs], old[~theirs])


def test_every_size_belongs_to_a_factor() -> None:
    """Every length, radius and joint offset that is not zero."""
    anatomy = FOURTEEN_PARTS
    body, _ = grown(anatomy, "stature", 1.0)
    known = {tuple(row) for row in entries_of(anatomy)[:, 1:].tolist()}
    for part in range(len(anatomy.parts)):
        assert {(SIZES, part, column) for column in range(3)} <= known
        assert {(TIPS, part, column) for column in range(2)} <= known
    for joint, column in np.argwhere(body.offsets != 0.0).tolist():
        assert (OFFSETS, joint, column) in known


def test_every_radius_of_the_ten_parts_belongs_to_a_factor() -> None:
    known = {tuple(row) for row in entries_of(TEN_PARTS)[:, 1:].tolist()}
    radii = {(SIZES, part, column) for part in range(10) for column in (LONG, SHORT)}
    assert known == radii | {(TIPS, part, column) for part in range(10) for column in range(2)}


def test_ten_parts_remain_cylinders() -> None:
    rng = np.random.default_rng(0)
    body = scaled(TEN_PARTS, average_body(TEN_PARTS, 1.75), rng.normal(scale=SPREADS))
    assert body.tips == pytest.approx(body.sizes[:, 1:])
    assert set(CYLINDERS) | set(SHARED) <= set(SIZE_NAMES)
    assert not set(CYLINDERS) & set(SHARED)


@each_anatomy
def test_limb_joints_remain_at_the_ends_of_the_parts(anatomy: Anatomy) -> None:
    body = scaled(anatomy, average_body(anatomy, 1.75), np.random.default_rng(1).normal(scale=SPREADS))
    index = anatomy.index
    for part, joint in (("right_upper_arm", "right_elbow"), ("left_upper_leg", "left_knee")):
        assert body.offsets[index[joint], 1] == pytest.approx(body.sizes[index[part], 0])
