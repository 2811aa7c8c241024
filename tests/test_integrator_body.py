"""The BDP integrator.  [Two-view 4.2]"""

import numpy as np
import pytest

from common.body.anatomy import TEN_PARTS
from common.body.proportions import body_from_lengths, lengths_of_height
from services.integrator.body import height_ratio, integrate_bodies

FRONT = dict(lengths_of_height(1.75))
SIDE = {name: FRONT[name] for name in ("height", "torso_depth", "head_depth")}


def test_the_ratio_is_the_side_height_over_the_front_height() -> None:
    assert height_ratio({"height": 1.6}, {"height": 1.8}) == pytest.approx(1.125)


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.2])
def test_the_side_viewers_lengths_are_brought_to_the_front_viewers_scale(scale: float) -> None:
    side = {name: scale * length for name, length in SIDE.items()}
    bdp, ratio = integrate_bodies(TEN_PARTS, [FRONT], [side])
    assert ratio == pytest.approx(scale)
    np.testing.assert_allclose(bdp.sizes, body_from_lengths(TEN_PARTS, FRONT).sizes)


def test_the_depth_is_the_sides_and_the_rest_the_fronts() -> None:
    side = SIDE | {"torso_depth": 0.31}
    bdp, _ = integrate_bodies(TEN_PARTS, [FRONT], [side])
    assert bdp.sizes[TEN_PARTS.index["torso"], 2] == pytest.approx(0.155)
    assert bdp.sizes[TEN_PARTS.index["torso"], 1] == pytest.approx(FRONT["torso_width"] / 2)


def test_one_bad_frame_does_not_count() -> None:
    bad = {name: 3 * length for name, length in FRONT.items()}
    bdp, ratio = integrate_bodies(TEN_PARTS, [FRONT, bad, FRONT], [SIDE, SIDE, SIDE])
    assert ratio == pytest.approx(1.0)
    np.testing.assert_allclose(bdp.sizes, body_from_lengths(TEN_PARTS, FRONT).sizes)


def test_a_body_no_person_has_is_refused() -> None:
    with pytest.raises(ValueError, match="is not a person's"):
        integrate_bodies(TEN_PARTS, [FRONT], [SIDE | {"torso_depth": 0.01}])
