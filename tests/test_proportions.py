import numpy as np
import pytest

from common.body.anatomy import TEN_PARTS
from common.body.definition import Pose
from common.body.kinematics import part_frames
from common.body.proportions import HIP_HEIGHT, body_from_lengths, stretched_angles

LENGTHS = {
    "height": 1.75, "torso_width": 0.42, "torso_depth": 0.24, "shoulder_line": 1.45, "arm_line": 1.40, "arm_span": 1.75,
    "arm_thickness": 0.09, "head_width": 0.16, "leg_width": 0.13,
}  # fmt: skip


def test_the_stretched_body_has_the_measured_lengths() -> None:
    bdp = body_from_lengths(TEN_PARTS, LENGTHS)
    hips = np.array([0.0, HIP_HEIGHT * LENGTHS["height"], 0.0])
    frames = part_frames(TEN_PARTS, bdp, Pose(hips, stretched_angles(TEN_PARTS)))
    ends = frames[:, :, 3] + bdp.sizes[:, :1] * frames[:, :, 1]
    at = {part: ends[k] for k, part in enumerate(TEN_PARTS.parts)}
    assert at["head"][1] == pytest.approx(LENGTHS["height"])
    assert at["torso"][1] == pytest.approx(LENGTHS["shoulder_line"])
    assert at["left_lower_arm"][0] - at["right_lower_arm"][0] == pytest.approx(LENGTHS["arm_span"])
    assert at["left_lower_arm"][1] == pytest.approx(LENGTHS["arm_line"])
    assert at["right_lower_leg"][1] == pytest.approx(0.0, abs=1e-12)


def test_the_body_is_symmetric() -> None:
    bdp = body_from_lengths(TEN_PARTS, LENGTHS)
    for k, joint in enumerate(TEN_PARTS.joints):
        if joint.name.startswith("right_"):
            twin = TEN_PARTS.index[joint.name.replace("right_", "left_")]
            np.testing.assert_array_equal(bdp.sizes[k], bdp.sizes[twin])
            np.testing.assert_array_equal(bdp.offsets[k] * [-1, 1, 1], bdp.offsets[twin])
            assert bdp.offsets[k][0] <= 0


def test_circular_parts_are_round_and_the_widths_are_halved() -> None:
    bdp = body_from_lengths(TEN_PARTS, LENGTHS)
    for part in TEN_PARTS.circular:
        assert bdp.sizes[TEN_PARTS.index[part], 1] == bdp.sizes[TEN_PARTS.index[part], 2] == LENGTHS["arm_thickness"] / 2
    np.testing.assert_allclose(
        bdp.sizes[TEN_PARTS.index["torso"], 1:], [LENGTHS["torso_width"] / 2, LENGTHS["torso_depth"] / 2]
    )


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_a_taller_person_has_longer_parts(scale: float) -> None:
    scaled = {name: scale * length for name, length in LENGTHS.items()}
    np.testing.assert_allclose(
        body_from_lengths(TEN_PARTS, scaled).sizes, scale * body_from_lengths(TEN_PARTS, LENGTHS).sizes
    )


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"shoulder_line": 0.90}, "torso"),
        ({"torso_depth": 0.01}, "torso"),
        ({"arm_span": 0.40}, "upper_arm"),
        ({"head_width": 3.0}, "head"),
        ({"height": 5.0, "shoulder_line": 4.6}, "torso"),
    ],
)
def test_a_body_no_person_has_is_refused_by_name(change: dict[str, float], part: str) -> None:
    with pytest.raises(ValueError, match=rf"^{part}: size .* is not a person's \(0.02 to 1.2\)"):
        body_from_lengths(TEN_PARTS, LENGTHS | change)
