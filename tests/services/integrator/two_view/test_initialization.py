"""The BDP integrator.  [Two-view 4.2]"""

import numpy as np
import pytest

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.services.integrator.two_view.initialization import integrate_bodies

FRONT = dict(average_lengths(1.75))
SIDE = {name: FRONT[name] for name in ("height", "torso_depth", "head_depth")}


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.2])
def test_the_lengths_of_the_side_viewer_are_scaled_to_those_of_the_front_viewer(scale: float) -> None:
    side = {name: scale * length for name, length in SIDE.items()}
    bdp, ratio = integrate_bodies(TEN_PARTS, [FRONT], [side])
    assert ratio == pytest.approx(scale)
    np.testing.assert_allclose(bdp.sizes, body_from_lengths(TEN_PARTS, FRONT).sizes)


def test_depths_are_those_of_the_side_viewer_and_other_lengths_those_of_the_front_viewer() -> None:
    side = SIDE | {"torso_depth": 0.31}
    bdp, _ = integrate_bodies(TEN_PARTS, [FRONT], [side])
    assert bdp.sizes[TEN_PARTS.index["torso"], 2] == pytest.approx(0.155)
    assert bdp.sizes[TEN_PARTS.index["torso"], 1] == pytest.approx(FRONT["torso_width"] / 2)


def test_one_outlier_frame_is_ignored() -> None:
    bad = {name: 3 * length for name, length in FRONT.items()}
    bdp, ratio = integrate_bodies(TEN_PARTS, [FRONT, bad, FRONT], [SIDE] * 3)
    assert ratio == pytest.approx(1.0)
    np.testing.assert_allclose(bdp.sizes, body_from_lengths(TEN_PARTS, FRONT).sizes)


def test_an_implausible_body_is_refused() -> None:
    with pytest.raises(ValueError, match=r"allowed: 0\.02 to 1\.2 m"):
        integrate_bodies(TEN_PARTS, [FRONT], [SIDE | {"torso_depth": 0.01}])
