"""Body definition from the T-pose: drawn figures, simulated silhouettes."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.support.simulated_cameras import paper_cameras
from tests.support.stored import stored
from tests.support.two_view_scene import rows
from zenocap.common.arrays import Mask
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.viewer.parameters import FINE_STEPS, FINE_TUNED, THIGH_BAND, TORSO_SIDE_BAND
from zenocap.services.viewer.two_view.body_definition import (
    Scale,
    fine_tuned,
    front_lengths,
    side_lengths,
    torso_columns,
    vertical_projection,
    without_head,
)
from zenocap.services.viewer.two_view.silhouette_features import is_front_posture, is_side_posture, silhouette_box
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import neutral
from zenocap.simulation.ground_truth import true_sizes, truth
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

DISTANCE_M = 5.2
PEOPLE = (1, 4, 7)
SCALE = Scale(depth=5.0, focal=250.0, horizon=60.0)  # 0.02 m a pixel


def figure() -> Mask:
    """100 px tall, arms stretched: head 12 wide, shoulders 18 below the top, torso 30 wide, arms 6 thick, span 100."""
    mask = np.zeros((140, 160), np.uint8)
    mask[20:40, 74:86] = 1  # head and neck
    mask[38:70, 65:95] = 1  # torso
    mask[40:46, 30:130] = 1  # arms
    mask[70:120, 66:76] = 1  # legs
    mask[70:120, 84:94] = 1
    return mask


def test_vertical_projection_counts_the_pixels_of_every_column() -> None:
    mask = figure()
    assert vertical_projection(mask).tolist() == mask.sum(axis=0).tolist()


def test_the_torso_is_the_columns_higher_than_the_mean() -> None:
    torso = torso_columns(figure())
    assert (torso.left, torso.right, torso.width, torso.centre) == (65, 95, 30, 79.5)
    assert torso.avg == pytest.approx(vertical_projection(figure())[30:130].mean())
    box = np.zeros((20, 20), np.uint8)
    box[5:15, 4:11] = 1
    assert (torso_columns(box).left, torso_columns(box).right) == (4, 11)


def test_the_head_is_removed_and_the_rest_of_the_torso_is_unchanged() -> None:
    headless = without_head(figure(), 30)
    assert np.flatnonzero(headless.any(axis=1))[0] == 38
    np.testing.assert_array_equal(headless[48:70, 65:95], figure()[48:70, 65:95])


@pytest.mark.parametrize("width", range(8, 40))
def test_removing_the_head_is_symmetric(width: int) -> None:
    mask = figure()
    mask[:, 30:40] = 0  # not symmetric
    there = without_head(mask, width)
    back = without_head(np.ascontiguousarray(mask[:, ::-1]), width)[:, ::-1]
    np.testing.assert_array_equal(there, back)


def test_front_lengths_of_a_drawn_figure() -> None:
    lengths = front_lengths(figure(), SCALE)
    expected = {
        "arm_span": 100, "arm_thickness": 6, "head_width": 12, "leg_width": 10, "thigh_width": 10, "torso_width": 30,
    }  # fmt: skip
    for name, px in expected.items():
        assert lengths[name] == pytest.approx(0.02 * px, abs=0.02 * 3), name
    assert lengths["height"] == pytest.approx(2.0, rel=0.04)  # without the toes, which are nearer


def test_the_height_is_measured_to_the_heels() -> None:
    """Soles that are nearer than the body stand lower in the image; without toes the height is that of the rows."""
    assert SCALE.height(20, 119, 0.0) == pytest.approx(100 * SCALE.metres_per_px)
    assert SCALE.height(20, 119, 0.06) < 100 * SCALE.metres_per_px
    top, sole = 1.7, -1.0  # metres above the horizon; the toes' depth is less by 0.06 heights
    nearer = 0.06 * (top - sole) / (1 + 0.06 * -sole / SCALE.depth)
    rows = [SCALE.horizon - SCALE.focal * y / z for y, z in ((top, SCALE.depth), (sole, SCALE.depth - nearer))]
    assert SCALE.height(round(rows[0] + 0.5), round(rows[1] - 0.5), 0.06) == pytest.approx(top - sole, abs=0.03)


def test_side_lengths_of_a_drawn_figure() -> None:
    mask = np.zeros((140, 160), np.uint8)
    mask[20:38, 70:84] = 1
    mask[38:120, 70:88] = 1
    lengths = side_lengths(mask, SCALE)
    assert lengths["torso_depth"] == pytest.approx(0.36)
    assert lengths["head_depth"] == pytest.approx(0.28)
    assert lengths["height"] == pytest.approx(2.0, rel=0.04)


@pytest.mark.parametrize(("measure", "band"), [(side_lengths, TORSO_SIDE_BAND), (front_lengths, THIGH_BAND)])
def test_a_part_that_is_missing_has_no_width(measure: Callable[[Mask, Scale], object], band: tuple[float, float]) -> None:
    mask = figure()
    mask[round(119 - 100 * band[1]) : round(121 - 100 * band[0])] = 0
    with pytest.raises(ValueError, match="gap"):
        measure(mask, SCALE)


@pytest.mark.parametrize("side", ["left", "right"])
def test_one_arm_is_not_the_initial_posture(side: str) -> None:
    mask = figure()
    mask[40:46, slice(30, 65) if side == "left" else slice(95, 130)] = 0
    with pytest.raises(ValueError, match="arm"):
        front_lengths(mask, SCALE)


@pytest.mark.parametrize(
    "measure",
    [torso_columns, silhouette_box, lambda mask: side_lengths(mask, SCALE), lambda mask: front_lengths(mask, SCALE)],
    ids=["torso", "box", "side", "front"],
)
def test_an_empty_silhouette_is_refused(measure: Callable[[Mask], object]) -> None:
    with pytest.raises(ValueError, match="no person"):
        measure(np.zeros((10, 10), np.uint8))


def silhouettes(seed: int, size: tuple[int, int], *, arms_down: bool = False) -> tuple[Mask, Mask]:
    """Exact masks of a person in T-pose from the front and from the side, as 0 and 1."""

    def render() -> Mask:
        subject = person(seed)
        pose = neutral(subject) if arms_down else t_pose(subject)
        cameras = [SimulatedCamera(camera, subject, 0) for camera in paper_cameras(size)]
        return np.array([camera.silhouette(pose) > 0 for camera in cameras], np.uint8)

    one, two = stored(render, "body definition", seed, size, arms_down)
    return one, two


@pytest.mark.slow
@pytest.mark.parametrize("seed", PEOPLE)
def test_hanging_arms_are_refused(seed: int) -> None:
    with pytest.raises(ValueError, match="no T-pose: an arm reaches"):
        front_lengths(silhouettes(seed, (160, 120), arms_down=True)[0], SCALE)


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(160, 120), (640, 480)])
@pytest.mark.parametrize("seed", PEOPLE)
def test_the_sizes_of_the_simulated_person_are_measured(seed: int, size: tuple[int, int]) -> None:
    """Within the accuracy of one silhouette; the evaluation measures the mean error."""
    matrix = paper_cameras(size)[0].matrix
    scale = Scale(DISTANCE_M, float(matrix[0, 0]), float(matrix[1, 2]))
    front, side = silhouettes(seed, size)
    sizes = true_sizes(person(seed))
    found = dict(side_lengths(side, scale)) | dict(front_lengths(front, scale))
    for name, true, tolerance in (
        ("height", sizes.torso + sizes.head + sizes.upper_leg + sizes.lower_leg, 0.05),
        ("arm_span", 2 * (sizes.shoulder_half + sizes.upper_arm + sizes.lower_arm), 0.10),
        ("torso_width", 2 * sizes.torso_half_width, 0.08),
        ("torso_depth", 2 * sizes.torso_half_depth, 0.07),
        ("arm_thickness", 2 * sizes.radii["upper_arm"], 0.05),
        ("leg_width", 2 * sizes.radii["lower_leg"], 0.05),
        ("thigh_width", 2 * sizes.radii["upper_leg"], 0.06),
        ("head_width", 2 * sizes.head_half_width, 0.06),
        ("head_depth", 2 * sizes.head_half_depth, 0.08),
    ):
        assert abs(found[name] - true) < tolerance + scale.metres_per_px, f"{name}: {found[name]:.3f}, truth {true:.3f}"


HIPS = truth(person(3), t_pose(person(3))).joints["Hip"]


def silhouette(viewer: int, *, arms_down: bool = False) -> Mask:
    return silhouettes(3, (160, 120), arms_down=arms_down)[viewer]


def test_the_silhouette_box_has_the_extents_of_the_mask() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[10:50, 30:40] = 1
    mask[20:24, 20:50] = 1
    shape = silhouette_box(mask)
    assert (shape.top, shape.bottom, shape.height, shape.width) == (10, 49, 40, 30)
    assert shape.column == 34.5
    assert shape.top < shape.navel_row < shape.bottom


@pytest.mark.nightly
def test_only_stretched_arms_are_the_front_posture() -> None:
    front, side = silhouette_box(silhouette(0)), silhouette_box(silhouette(1))
    assert (is_front_posture(front), is_side_posture(front)) == (True, False)
    assert (is_front_posture(side), is_side_posture(side)) == (False, True)
    assert not is_front_posture(silhouette_box(silhouette(0, arms_down=True)))


def test_fine_tuning_changes_only_its_lengths_and_within_bounds() -> None:
    mask, camera = silhouette(0), rows(0)
    depth = float(camera[2] @ HIPS + camera[3, 2])
    measured = front_lengths(mask, Scale(depth, float(camera[4, 0]), float(camera[4, 2])))
    tuned = fine_tuned(TEN_PARTS, mask, camera, HIPS, np.eye(3))
    assert set(tuned) == set(measured)
    for name, length in tuned.items():
        if name in FINE_TUNED:
            assert min(FINE_STEPS) - 1e-9 <= length / measured[name] <= max(FINE_STEPS) + 1e-9
        else:
            assert length == measured[name]


@pytest.mark.slow
def test_fine_tuning_refuses_another_posture() -> None:
    with pytest.raises(ValueError, match="arm"):
        fine_tuned(TEN_PARTS, silhouette(0, arms_down=True), rows(0), HIPS, np.eye(3))
