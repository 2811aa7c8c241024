"""Body from measured lengths: sizes, symmetry, scale, and implausible values."""

import numpy as np
import pytest

from tests.support.anatomies import assert_symmetric
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.proportions import HIP_HEIGHT, KNEE_HEIGHT, average_lengths, body_from_lengths, t_pose_angles

LENGTHS = {
    "height": 1.75, "torso_width": 0.34, "torso_depth": 0.24, "arm_span": 1.78, "arm_thickness": 0.09, "head_width": 0.16,
    "head_depth": 0.19, "thigh_width": 0.16, "leg_width": 0.11,
}  # fmt: skip


def test_the_body_in_t_pose_has_the_measured_lengths() -> None:
    bdp = body_from_lengths(TEN_PARTS, LENGTHS)
    hips = np.array([0.0, HIP_HEIGHT * LENGTHS["height"], 0.0])
    frames = part_frames(TEN_PARTS, bdp, Pose(hips, t_pose_angles(TEN_PARTS)))
    ends = frames[:, :, 3] + bdp.sizes[:, :1] * frames[:, :, 1]
    at = {part: ends[k] for k, part in enumerate(TEN_PARTS.parts)}
    assert at["head"][1] == pytest.approx(LENGTHS["height"])
    assert at["left_lower_arm"][0] - at["right_lower_arm"][0] == pytest.approx(LENGTHS["arm_span"])
    assert at["left_lower_arm"][1] == pytest.approx(at["torso"][1])
    assert at["right_upper_leg"][1] == pytest.approx(KNEE_HEIGHT * LENGTHS["height"])
    assert at["right_lower_leg"][1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("part", "radii"),
    [
        ("torso", ("torso_width", "torso_depth")), ("head", ("head_width", "head_depth")),
        ("right_lower_arm", ("arm_thickness", "arm_thickness")), ("left_upper_leg", ("thigh_width", "thigh_width")),
        ("right_lower_leg", ("leg_width", "leg_width")),
    ],
)  # fmt: skip
def test_radii_are_half_the_widths(part: str, radii: tuple[str, str]) -> None:
    bdp = body_from_lengths(TEN_PARTS, LENGTHS)
    np.testing.assert_allclose(2 * bdp.sizes[TEN_PARTS.index[part], 1:], [LENGTHS[name] for name in radii])


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_the_body_is_symmetric_and_longer_for_a_taller_person(scale: float) -> None:
    scaled = {name: scale * length for name, length in LENGTHS.items()}
    one, other = body_from_lengths(TEN_PARTS, LENGTHS), body_from_lengths(TEN_PARTS, scaled)
    assert_symmetric(TEN_PARTS, one)
    np.testing.assert_allclose(other.sizes, scale * one.sizes)
    np.testing.assert_allclose(other.offsets, scale * one.offsets)


@pytest.mark.parametrize("height", [1.2, 1.5, 1.75, 2.0])
def test_a_body_of_average_lengths_has_its_height(height: float) -> None:
    bdp = body_from_lengths(TEN_PARTS, average_lengths(height))
    index = TEN_PARTS.index
    standing = sum(bdp.sizes[index[part], 0] for part in ("torso", "head", "left_upper_leg", "left_lower_leg"))
    assert standing == pytest.approx(height)


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"torso_depth": 0.01}, "torso"), ({"arm_span": 0.40}, "upper_arm"), ({"head_width": 3.0}, "head"),
        ({"height": 5.0}, "torso"), ({"leg_width": 0.0}, "lower_leg"),
    ],
)  # fmt: skip
def test_an_implausible_size_raises_an_error_that_names_the_part(change: dict[str, float], part: str) -> None:
    with pytest.raises(ValueError, match=rf"^{part}: size .* m; allowed: 0.02 to 1.2 m"):
        body_from_lengths(TEN_PARTS, LENGTHS | change)
