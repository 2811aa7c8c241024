"""Exported files in Blender: joints at their places with the documented settings.

Needs an interpreter with the package bpy (350 MB, so it is not in the extra `dev`): this one, or the one at
build/blender/bin/python, made by `python -m venv build/blender && build/blender/bin/pip install bpy`.
"""

import json
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.places import ROOT
from tests.support.pose_tracks import moving
from zenocap.common.formats.take_poses import read_poses
from zenocap.tools.takes.export import ExportOptions, export

OWN = ROOT / "build" / "blender" / "bin" / "python"
JOINTS = {
    "Hip": "Hips", "RHip": "RightUpLeg", "RKnee": "RightLeg", "RAnkle": "RightFoot", "LHip": "LeftUpLeg",
    "LKnee": "LeftLeg", "LAnkle": "LeftFoot", "RShoulder": "RightArm", "RElbow": "RightForeArm", "RWrist": "RightHand",
    "LShoulder": "LeftArm", "LElbow": "LeftForeArm", "LWrist": "LeftHand",
}  # fmt: skip
# Suffix, options of the export, scale of the importer, frame of the scene at which the first row is, and the scene's
# range of frames after the import: for USD its own, else Blender's, which BVH can only lengthen.
FILES = [
    ("bvh", ExportOptions("bvh"), 0.01, 1, [1, 250]),
    ("bvh", ExportOptions("bvh", unit="m"), 1.0, 1, [1, 250]),
    ("glb", ExportOptions("glb"), 1.0, 0, [1, 250]),
    ("usdc", ExportOptions("usd"), 1.0, 0, [0, 9]),
]
ROWS = (0, 3, 7)


@cache
def interpreter() -> str | None:
    return sys.executable if find_spec("bpy") else str(OWN) if OWN.is_file() else None


pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(interpreter() is None, reason="Blender's package bpy is not installed, see the top of this file"),
]


def in_blender(*arguments: object) -> dict:
    command = [str(interpreter()), str(ROOT / "tests" / "support" / "blender.py"), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(next(line for line in reversed(done.stdout.splitlines()) if line.startswith("{")))


@pytest.mark.parametrize(("suffix", "options", "scale", "first", "span"), FILES, ids=["bvh-cm", "bvh-m", "glb", "usd"])
def test_blender_has_the_joints_where_they_are(
    suffix: str, options: ExportOptions, scale: float, first: int, span: list[int], tmp_path: Path
) -> None:
    take = write_take(tmp_path / "take.mcap", messages_of_track(moving(10, rate=30.0)))
    export(take, tmp_path / f"a.{suffix}", options)
    frames = ",".join(str(first + row) for row in ROWS)
    picture = [tmp_path / "a.png"] if suffix == "glb" else []
    result = in_blender(tmp_path / f"a.{suffix}", scale, frames, *picture)
    assert result["rate"] == pytest.approx(30.0)
    assert result["range"] == span
    assert ("MESH" in result["objects"]) == (suffix != "bvh")
    expected = read_poses(take).trajectories()
    for row in ROWS:
        bones = result["bones"][str(first + row)]
        for ours, bone in JOINTS.items():
            x, y, z = expected.points[row, expected.names.index(ours)]
            np.testing.assert_allclose(bones[bone], [x, -z, y], atol=2e-4)  # Blender: Z up, the front is -Y
    for path in picture:
        image = cv2.imread(str(path)).astype(int)
        orange = (image[..., 2] > image[..., 0] + 40) & (image[..., 2] > 60)
        blue = (image[..., 0] > image[..., 2] + 20) & (image[..., 0] > 40)
        assert orange.sum() > 50  # left limbs
        assert blue.sum() > 50  # right limbs
