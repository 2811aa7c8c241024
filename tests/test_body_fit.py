"""The whole model over a silhouette: its totals are those of counting pixels, whatever was done to it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from two_view_scene import ANGLES, BDP, MODEL, NAVEL, SMALL, directions, model_mask, rows

from common.body.anatomy import TEN_PARTS, Floats
from common.body.definition import Pose
from common.body.kinematics import part_frames
from common.body.limbs import limb_directions
from common.body.torso import torso_rotation
from common.vision.matching import matching_score
from common.vision.model_image import ADD, REMOVE, cover_part
from services.viewer.body_fit import BodyFit, body_model, core_score

STANDING = directions()


@given(ANGLES, st.sampled_from([0, 1]))
@settings(deadline=None, max_examples=50)  # the first example compiles
def test_the_model_is_the_anatomy_placed_by_its_kinematics(angles: Floats, viewer: int) -> None:
    """Round limbs and a straight head, since limbs are placed by direction alone."""
    angles[[TEN_PARTS.index[f"neck.{axis}"] for axis in "zxy"]] = 0.0
    fit = BodyFit(MODEL, rows(viewer), np.ones(SMALL[::-1], np.uint8))
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles))
    fit.place(NAVEL, np.ascontiguousarray(frames[0, :, :3]), limb_directions(TEN_PARTS, angles))
    expected = np.zeros(SMALL[::-1], np.uint8)
    totals = np.zeros(3, np.int64)
    for frame, size in zip(frames, BDP.sizes, strict=True):
        cover_part(np.ascontiguousarray(frame), size, rows(viewer), fit.picture.mask, expected, ADD, totals)
    # The corners of a round part's outline lie elsewhere when its frame is turned about its own axis.
    differing = np.count_nonzero((fit.picture.cover > 0) != (expected > 0))
    assert differing <= 0.08 * np.count_nonzero(expected)


@given(ANGLES)
@settings(deadline=None, max_examples=30)
def test_the_score_is_equation_1_of_the_two_images(angles: Floats) -> None:
    mask = model_mask(rows(0), STANDING)
    fit = BodyFit(MODEL, rows(0), mask)
    score = fit.place(NAVEL, np.eye(3), limb_directions(TEN_PARTS, angles))
    assert score == fit.score() == pytest.approx(matching_score(mask, fit.picture.cover > 0))


def test_the_models_own_silhouette_matches_fully() -> None:
    fit = BodyFit(MODEL, rows(1), model_mask(rows(1), STANDING))
    assert fit.place(NAVEL, np.eye(3), STANDING) == 1.0


def test_parts_taken_off_and_put_back_leave_no_trace() -> None:
    fit = BodyFit(MODEL, rows(0), model_mask(rows(1), STANDING))
    fit.place(NAVEL, np.eye(3), STANDING)
    cover, totals = fit.picture.cover.copy(), fit.picture.totals.copy()
    fit.core(REMOVE)
    for k in range(4):
        fit.limb(k, REMOVE)
    assert not fit.picture.cover.any()
    assert fit.picture.totals.tolist() == [totals[0], 0, 0]
    for k in range(4):
        fit.limb(k, ADD)
    fit.core(ADD)
    np.testing.assert_array_equal(fit.picture.cover, cover)
    np.testing.assert_array_equal(fit.picture.totals, totals)


def test_the_cores_score_is_that_of_the_whole_model() -> None:
    fit = BodyFit(MODEL, rows(0), model_mask(rows(0), STANDING))
    bowed = torso_rotation(0.0, 0.4, 0.1)
    fit.place(NAVEL, bowed, STANDING @ bowed)
    expected = fit.score()
    fit.core(REMOVE)
    before = fit.picture.cover.copy()
    assert core_score(NAVEL, bowed, MODEL, fit.picture) == pytest.approx(expected)
    np.testing.assert_array_equal(fit.picture.cover, before)


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
