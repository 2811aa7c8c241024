"""The average body of a height."""

import numpy as np
import pytest

from tests.support.anatomies import assert_symmetric, each_anatomy
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.kinematics import part_frames
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import model_of


def heights(anatomy: Anatomy, stature: float) -> Floats:
    """(2,) lowest and highest point of the upright body, hips at 0.53 of the stature."""
    body = average_body(anatomy, stature)
    model = model_of(anatomy, body)
    frames = part_frames(anatomy, body, neutral_pose(anatomy, np.array([0.0, 0.53 * stature, 0.0])))
    base = frames[:, 1, 3] + np.einsum("pj,pj->p", frames[:, 1, :3], model.bases)
    ends = np.concatenate([base, base + model.lengths * frames[:, 1, 1]])
    deep = np.concatenate([model.radii[:, :2].mean(axis=1), model.radii[:, 2:].mean(axis=1)])
    return np.array([(ends - deep).min(), (ends + deep).max()])


@each_anatomy
@pytest.mark.parametrize("stature", [1.5, 1.75, 2.0])
def test_average_body_spans_its_height(anatomy: Anatomy, stature: float) -> None:
    low, top = heights(anatomy, stature)
    assert low == pytest.approx(0.0, abs=0.02 * stature)
    assert top == pytest.approx(stature, rel=0.02)


@each_anatomy
def test_body_is_symmetric_and_scales_with_the_height(anatomy: Anatomy) -> None:
    small, tall = average_body(anatomy, 1.0), average_body(anatomy, 1.8)
    assert_symmetric(anatomy, tall)
    assert tall.sizes == pytest.approx(1.8 * small.sizes)
    assert tall.offsets == pytest.approx(1.8 * small.offsets)
