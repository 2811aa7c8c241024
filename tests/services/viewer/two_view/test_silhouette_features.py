"""Facade or flank by the width of the upper body.  [Two-view 3.1]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.two_view_scene import MODEL, NAVEL, directions, model_mask, rows
from zenocap.services.viewer.parameters import BELOW_HIPS, UPPER_BODY_COLUMN
from zenocap.services.viewer.two_view.silhouette_features import own_view, toes_offset, upper_body_width

HIP_ROW, TORSO = 60, 40


def drawn(*boxes: tuple[int, int, int, int]) -> np.ndarray:
    """A mask (120, 160) of boxes: left, top, right, bottom, the last two excluded."""
    mask = np.zeros((120, 160), np.uint8)
    for left, top, right, bottom in boxes:
        mask[top:bottom, left:right] = 1
    return mask


def test_the_width_is_that_of_the_torso_without_arms_and_legs() -> None:
    torso, head = (70, 20, 90, 60), (75, 5, 85, 20)
    arms, legs = (40, 25, 120, 32), (65, 60, 95, 115)
    assert upper_body_width(drawn(torso, head, arms, legs), HIP_ROW, TORSO) == 20


def test_only_columns_above_the_threshold_and_above_the_hips_count() -> None:
    high, bottom = int(UPPER_BODY_COLUMN * TORSO) + 1, round(HIP_ROW + BELOW_HIPS * TORSO)
    assert upper_body_width(drawn((70, 60 - high, 80, 60)), HIP_ROW, TORSO) == 10
    for above, width in ((0, 0), (high - 1, 0), (high, 10)):
        assert upper_body_width(drawn((70, bottom - above, 80, bottom + 50)), HIP_ROW, TORSO) == width


def test_the_width_includes_gaps_between_the_outermost_columns() -> None:
    assert upper_body_width(drawn((70, 20, 75, 60), (80, 20, 90, 60)), HIP_ROW, TORSO) == 20


@given(st.floats(-500, 500))
def test_a_hip_row_outside_the_image_raises_no_error(hip_row: float) -> None:
    assert 0 <= upper_body_width(drawn((70, 20, 90, 60)), hip_row, TORSO) <= 20


def test_the_facade_is_wider_than_the_flank() -> None:
    limbs = directions()
    focal = rows(0)[4, 0]
    torso_px = MODEL.torso[0] * focal / 5.2
    hip_row = rows(0)[4, 2] + focal * (1.0 - NAVEL[1]) / 5.2
    facade, flank = (upper_body_width(model_mask(rows(viewer), limbs), hip_row, torso_px) for viewer in (0, 1))
    assert facade > 1.3 * flank > 0


@pytest.mark.parametrize(
    ("before", "width", "after"),
    [
        ("facade", 0.19, "flank"), ("facade", 0.20, "facade"), ("facade", 0.25, "facade"), ("facade", 0.4, "facade"),
        ("flank", 0.31, "facade"), ("flank", 0.30, "flank"), ("flank", 0.25, "flank"), ("flank", 0.1, "flank"),
    ],
)  # fmt: skip
def test_the_view_changes_only_past_the_far_threshold(before: str, width: float, after: str) -> None:
    assert own_view(before, width, 0.20, 0.30) == after  # type: ignore[arg-type]  # parametrized literals


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_toes_offset_has_the_facing_direction_in_the_flank(mirrored: bool) -> None:
    """In px to the right of the image."""
    legs, feet = (70, 20, 80, 118), (70, 117, 92, 120)
    mask = drawn(legs, feet)
    offset = toes_offset(np.ascontiguousarray(mask[:, ::-1]) if mirrored else mask)
    assert offset * (-1 if mirrored else 1) == pytest.approx((92 - 80) / 2, abs=1.0)


def test_the_toes_offset_is_zero_without_feet() -> None:
    assert toes_offset(np.zeros((120, 160), np.uint8)) == 0.0
    assert toes_offset(drawn((70, 20, 80, 120))) == pytest.approx(0.0)
