"""The body as printed in the paper, measured in the silhouettes of simulated people.  [Two-view 2.4]"""

from math import degrees

import numpy as np
import pytest

from tests.support.two_view_scene import BDP, MODEL, NAVEL, directions, model_mask, rows
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import (
    PAPER_FRONT_LENGTHS,
    PAPER_SIDE_LENGTHS,
    PAPER_TORSO_SHARE,
    TORSO_SHARE,
    body_from_paper_lengths,
)
from zenocap.services.viewer.two_view.paper.body_definition import fine_tuned, front_measures, side_lengths
from zenocap.services.viewer.two_view.paper.projection import orthographic

DEPTH = 5.2
T_POSE = {"right_shoulder_z": 90.0, "left_shoulder_z": 270.0}
LARGE = (640, 480)
FRONT = model_mask(orthographic(rows(0, LARGE), DEPTH), directions(**T_POSE), size=LARGE)
METRES_PER_PX = DEPTH / float(rows(0, LARGE)[4, 0])
INDEX = TEN_PARTS.index


def test_front_view_measures_head_torso_and_arms() -> None:
    lengths, arm_angle = front_measures(FRONT)
    assert set(lengths) == set(PAPER_FRONT_LENGTHS)
    assert lengths["height"] * METRES_PER_PX == pytest.approx(1.75, abs=0.25)
    arm = float(MODEL.limbs[0, :, 0].sum())
    assert lengths["arm"] * METRES_PER_PX == pytest.approx(arm, abs=0.12)  # from the edge of the torso, not the joint
    assert abs(degrees(arm_angle) - 90) < 15


@pytest.mark.parametrize("pose", [{}, {"right_shoulder_z": 90.0}])
def test_other_posture_is_an_error(pose: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="no T-pose"):
        front_measures(model_mask(orthographic(rows(0, LARGE), DEPTH), directions(**pose), size=LARGE))


def test_empty_side_view_is_an_error() -> None:
    with pytest.raises(ValueError, match="empty"):
        side_lengths(np.zeros((48, 64), np.uint8), 0.01)


@pytest.mark.parametrize("share", [PAPER_TORSO_SHARE, TORSO_SHARE])
def test_body_has_the_shares_of_the_paper(share: float) -> None:
    side = side_lengths(model_mask(orthographic(rows(1, LARGE), DEPTH), directions(**T_POSE), size=LARGE), METRES_PER_PX)
    assert set(side) == set(PAPER_SIDE_LENGTHS)
    front = fine_tuned(TEN_PARTS, FRONT, rows(0, LARGE), NAVEL, np.eye(3), share)
    body = body_from_paper_lengths(TEN_PARTS, {**front, **side}, share)
    torso, upper, lower = (body.sizes[INDEX[part]] for part in ("torso", "right_upper_leg", "right_lower_leg"))
    shoulder = front["height"] - front["head"]
    assert torso[0] == pytest.approx(share * shoulder)
    assert upper[0] == lower[0] == pytest.approx((1 - share) * shoulder / 2)
    np.testing.assert_allclose(upper[1:], [0.2 * front["torso_width"], 0.36 * front["torso_width"]])
    np.testing.assert_allclose(body.sizes[INDEX["head"], 1:], [0.2 * front["torso_width"], 0.16 * front["torso_width"]])
    np.testing.assert_allclose(torso[0], BDP.sizes[INDEX["torso"], 0], rtol=0.2)
