"""The whole model over a silhouette: its totals equal counted pixels after any sequence of changes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.two_view_scene import ANGLES, BDP, MODEL, NAVEL, SMALL, directions, model_mask, rows
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.segments import limb_directions, torso_rotation
from zenocap.common.vision.model_image import ADD, CORNERS, REMOVE, cover_outline, part_outline, score_of_counts
from zenocap.services.viewer.two_view.body_fit import BodyFit, body_model

STANDING = directions()


@pytest.mark.slow
@given(ANGLES, st.sampled_from([0, 1]))
@settings(deadline=None, max_examples=50)  # the first example compiles
def test_the_model_is_the_anatomy_placed_by_its_kinematics(angles: Floats, viewer: int) -> None:
    """Round limbs and a straight head, since limbs are placed by direction only."""
    angles[[TEN_PARTS.index[f"neck.{axis}"] for axis in "zxy"]] = 0.0
    fit = BodyFit(MODEL, rows(viewer), np.ones(SMALL[::-1], np.uint8))
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles))
    fit.place(NAVEL, np.ascontiguousarray(frames[0, :, :3]), limb_directions(TEN_PARTS, angles))
    expected = np.zeros(SMALL[::-1], np.uint8)
    totals, corners = np.zeros(3, np.int64), np.empty((CORNERS, 2))
    for frame, size in zip(frames, BDP.sizes, strict=True):
        assert part_outline(np.ascontiguousarray(frame), size, rows(viewer), corners)
        cover_outline(corners, fit.image.mask, expected, ADD, totals)
    # Turning the frame of a round part about its own axis moves the corners of its outline.
    differing = np.count_nonzero((fit.image.cover > 0) != (expected > 0))
    assert differing <= 0.08 * np.count_nonzero(expected)


@given(ANGLES)
@settings(deadline=None, max_examples=30)
def test_the_score_is_equation_1_of_the_two_images(angles: Floats) -> None:
    mask = model_mask(rows(0), STANDING)
    fit = BodyFit(MODEL, rows(0), mask)
    score = fit.place(NAVEL, np.eye(3), limb_directions(TEN_PARTS, angles))
    model = fit.image.cover > 0
    counts = np.count_nonzero(mask), np.count_nonzero(model), np.count_nonzero(model & (mask > 0))
    assert score == fit.score() == pytest.approx(score_of_counts(*counts))


def test_removing_and_adding_all_limbs_restores_the_cover() -> None:
    fit = BodyFit(MODEL, rows(0), model_mask(rows(1), STANDING))
    fit.place(NAVEL, np.eye(3), STANDING)
    cover, totals = fit.image.cover.copy(), fit.image.totals.copy()
    for k in range(4):
        fit.cover_limb(k, REMOVE)
    assert np.count_nonzero(fit.image.cover) < np.count_nonzero(cover)
    for k in range(4):
        fit.cover_limb(k, ADD)
    np.testing.assert_array_equal(fit.image.cover, cover)
    np.testing.assert_array_equal(fit.image.totals, totals)


def test_the_views_axis_runs_from_the_camera_to_the_navel() -> None:
    for viewer, centre in ((0, [0.0, 1.0, 5.2]), (1, [-5.2, 1.0, 0.0])):
        fit = BodyFit(MODEL, rows(viewer), np.zeros(SMALL[::-1], np.uint8))
        turned = torso_rotation(0.5, 0.2, -0.1)
        fit.place(NAVEL, turned, STANDING)
        ray = NAVEL - np.array(centre)
        np.testing.assert_allclose(turned @ fit.view_axis, ray / np.linalg.norm(ray), atol=1e-12)
        assert fit.depth() == pytest.approx(5.2)
        assert fit.metres_per_pixel() == pytest.approx(5.2 / rows(viewer)[4, 0])


def test_the_model_has_the_bodys_sizes() -> None:
    model = body_model(TEN_PARTS, BDP)
    np.testing.assert_array_equal(model.torso, BDP.sizes[TEN_PARTS.index["torso"]])
    np.testing.assert_array_equal(model.limbs[1, 0], BDP.sizes[TEN_PARTS.index["left_upper_arm"]])
    np.testing.assert_array_equal(model.origins[2], BDP.offsets[TEN_PARTS.index["right_hip"]])
