"""The ten-part body of [Two-view 2.1], and invariants of every anatomy's tables."""

import numpy as np

from tests.support.anatomies import other_side
from zenocap.common.body.anatomy import FLEXION_AXES, NAVEL_AXES, SPHERICAL_AXES, TEN_PARTS

HALPE = (
    "Hip", "RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle", "Neck", "Head",
    "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist",
)  # fmt: skip


def test_six_spherical_joints_and_four_hinges_after_their_parents() -> None:
    spherical = [j for j in TEN_PARTS.joints if j.axes in (SPHERICAL_AXES, NAVEL_AXES)]
    flexion = [j for j in TEN_PARTS.joints if j.axes == FLEXION_AXES]
    assert (len(spherical), len(flexion), len(TEN_PARTS.joints), len(set(TEN_PARTS.parts))) == (6, 4, 10, 10)
    assert {j.name for j in flexion} == {"right_elbow", "left_elbow", "right_knee", "left_knee"}
    assert all(j.parent in ("", *TEN_PARTS.parts[:k]) for k, j in enumerate(TEN_PARTS.joints))


def test_twenty_two_angles_with_an_index_each() -> None:
    assert len(set(TEN_PARTS.angles)) == 22
    assert [TEN_PARTS.index[name] for name in TEN_PARTS.angles] == list(range(22))
    assert [TEN_PARTS.index[part] for part in TEN_PARTS.parts] == list(range(10))
    assert all(TEN_PARTS.index[j.name] == TEN_PARTS.index[j.part] for j in TEN_PARTS.joints)


def test_limits_contain_the_neutral_pose_and_are_mirrored_between_left_and_right() -> None:
    low, high = TEN_PARTS.limits.T
    assert TEN_PARTS.limits.shape == (22, 2)
    assert np.all(low < high)
    assert np.all((low <= TEN_PARTS.neutral) & (TEN_PARTS.neutral <= high))
    for name, limits in zip(TEN_PARTS.angles, TEN_PARTS.limits, strict=True):
        if name.startswith("right_"):
            left = TEN_PARTS.limits[TEN_PARTS.index[other_side(name)]]
            np.testing.assert_allclose(left, 2 * np.pi - limits[::-1] if name.endswith(".z") else limits)


def test_knees_flex_backward_only_and_elbows_have_the_papers_range() -> None:
    index = TEN_PARTS.index
    assert np.all(TEN_PARTS.limits[[index["right_knee.x"], index["left_knee.x"]], 1] == 0.0)
    np.testing.assert_allclose(np.degrees(TEN_PARTS.limits[index["right_elbow.x"]]), [-140, 140])


def test_markers_are_the_fifteen_halpe_joints() -> None:
    assert tuple(marker.name for marker in TEN_PARTS.markers) == HALPE
    for marker in TEN_PARTS.markers:
        assert bool(marker.part) != bool(marker.joints)
        assert 0.0 <= marker.along <= 1.0


def test_the_table_for_compiled_code_equals_the_joints() -> None:
    first = 0
    for row, joint in zip(TEN_PARTS.tree, TEN_PARTS.joints, strict=True):
        assert row[0] == (TEN_PARTS.parts.index(joint.parent) if joint.parent else -1)
        assert TEN_PARTS.angles[row[1]] == f"{joint.name}.{joint.axes[0]}"
        assert "".join("xyz"[a] for a in row[2:] if a >= 0) == joint.axes
        assert row[1] == first
        first += len(joint.axes)
