"""USD: OpenUSD's own skinning puts the body where the poses are; its validators find nothing."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.pose_tracks import moving
from tests.support.scene_takes import motion_of
from zenocap.common.formats.animated_skeleton import AnimatedSkeleton

pytest.importorskip("pxr", reason="usd-core is not installed: the extra usd")

from pxr import Usd, UsdGeom, UsdSkel, UsdValidation

from zenocap.common.formats.usd import identifier, write_usd


@pytest.fixture(scope="module")
def motion() -> AnimatedSkeleton:
    return motion_of(moving(8, lost=(3, 4)))


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz", ".usd"])
def test_the_validators_of_openusd_find_nothing(suffix: str, motion: AnimatedSkeleton, tmp_path: Path) -> None:
    path = tmp_path / f"walk{suffix}"
    write_usd(path, motion, "walk 1")
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    stage = Usd.Stage.Open(str(path))
    assert [error.GetMessage() for error in UsdValidation.ValidationContext(validators).Validate(stage)] == []
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Y", 1.0)
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (30.0, 0.0, 7.0)


def test_skinned_points_are_where_the_pose_is(motion: AnimatedSkeleton, tmp_path: Path) -> None:
    write_usd(tmp_path / "a.usdc", motion, "a")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    root, mesh = UsdSkel.Root.Get(stage, "/a"), UsdGeom.Mesh.Get(stage, "/a/Body")
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    skinning = cache.GetSkinningQuery(mesh.GetPrim())
    skeleton = cache.GetSkelQuery(UsdSkel.Skeleton.Get(stage, "/a/Skeleton"))
    points = mesh.GetPointsAttr().Get()
    for row in (0, 6):
        skinned = mesh.GetPointsAttr().Get()
        assert skinning.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(row), skinned, row)
        found = np.array(skinned)
        hips = motion.skin.bones == 0  # their points are relative to the root: only turned and moved by it
        turned = Rotation.from_quat(motion.rotations[row, 0]).apply(motion.skin.points[hips])
        np.testing.assert_allclose(found[hips], turned + motion.positions[row], atol=1e-4)
        low, high = (np.array(bound) for bound in root.GetExtentAttr().Get())
        assert (found > low).all()
        assert (found < high).all()
    assert np.array(points)[:, 1].min() == pytest.approx(0.0, abs=1e-6)


def test_the_body_is_invisible_while_the_person_is_lost(motion: AnimatedSkeleton, tmp_path: Path) -> None:
    write_usd(tmp_path / "a.usda", motion, "a")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    seen = UsdGeom.Imageable(stage.GetPrimAtPath("/a"))
    assert [seen.ComputeVisibility(row) for row in (2, 3, 4, 5)] == ["inherited", "invisible", "invisible", "inherited"]


def test_names_of_prims() -> None:
    assert [identifier(name) for name in ("walk-1", "1st", "ä")] == ["walk_1", "_1st", "_"]
