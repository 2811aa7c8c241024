"""glTF: an independent reader finds skeleton, skin and motion; rules of the format."""

import json
import struct
from pathlib import Path

import numpy as np
import pygltflib
import pytest

from tests.support.pose_tracks import moving
from tests.support.scene_takes import motion_of
from zenocap.common.formats.animated_skeleton import AnimatedSkeleton
from zenocap.common.formats.gltf import write_glb

KINDS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
DTYPES = {5121: np.uint8, 5125: np.uint32, 5126: np.float32}


@pytest.fixture(scope="module")
def motion() -> AnimatedSkeleton:
    return motion_of(moving(10, lost=(4,)))


@pytest.fixture(scope="module")
def content(motion: AnimatedSkeleton, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, bytes]:
    """JSON and binary chunk, read by the format's definition."""
    path = tmp_path_factory.mktemp("gltf") / "a.glb"
    write_glb(path, motion, "walk 1")
    data = path.read_bytes()
    magic, version, length, json_length, kind = struct.unpack_from("<4sIIII", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), 0x4E4F534A)
    binary_length, kind = struct.unpack_from("<II", data, 20 + json_length)
    assert (kind, binary_length % 4, json_length % 4) == (0x004E4942, 0, 0)
    return json.loads(data[20 : 20 + json_length]), data[28 + json_length :]


def values(content: tuple[dict, bytes], accessor: int) -> np.ndarray:
    file, binary = content
    one = file["accessors"][accessor]
    view = file["bufferViews"][one["bufferView"]]
    assert view["byteOffset"] % 4 == 0
    columns, dtype = KINDS[one["type"]], DTYPES[one["componentType"]]
    array = np.frombuffer(binary, dtype, one["count"] * columns, view["byteOffset"]).reshape(one["count"], columns)
    if "min" in one:
        np.testing.assert_array_equal([array.min(axis=0), array.max(axis=0)], [one["min"], one["max"]])
    return array


def test_the_animation_is_the_motion(content: tuple[dict, bytes], motion: AnimatedSkeleton) -> None:
    file, _ = content
    (animation,) = file["animations"]
    assert animation["name"] == "walk 1"
    found = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times = values(content, sampler["input"])[:, 0]
        assert (np.diff(times) > 0).all()
        np.testing.assert_allclose(times, motion.times_s, atol=1e-6)
        target = channel["target"]
        found[file["nodes"][target["node"]]["name"], target["path"]] = values(content, sampler["output"])
    np.testing.assert_allclose(found["Hips", "translation"], motion.positions, atol=1e-6)
    for bone in np.flatnonzero(motion.moving):
        np.testing.assert_allclose(found[motion.names[bone], "rotation"], motion.rotations[:, bone], atol=1e-6)
    assert ("LeftShoulder", "rotation") not in found  # does not move


def test_the_skin_rests_where_the_bones_are(content: tuple[dict, bytes], motion: AnimatedSkeleton) -> None:
    file, _ = content
    (skin,) = file["skins"]
    assert [file["nodes"][joint]["name"] for joint in skin["joints"]] == list(motion.names)
    inverse = values(content, skin["inverseBindMatrices"]).reshape(-1, 4, 4)
    np.testing.assert_allclose(inverse[:, 3, :3], -motion.places, atol=1e-6)
    primitives = file["meshes"][0]["primitives"]
    triangles = sum(len(values(content, one["indices"])) for one in primitives) // 3
    assert triangles == len(motion.skin.triangles)
    joints, weights = (values(content, primitives[0]["attributes"][name]) for name in ("JOINTS_0", "WEIGHTS_0"))
    assert joints.max() < len(motion.names)
    np.testing.assert_array_equal(weights.sum(axis=1), 1.0)
    np.testing.assert_array_equal(joints[weights == 0], 0)  # as the specification demands


def test_the_bones_of_a_humanoid_are_named(content: tuple[dict, bytes]) -> None:
    file, _ = content
    assert file["extensionsUsed"] == ["VRMC_vrm_animation"]
    bones = file["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]
    assert file["nodes"][bones["leftUpperArm"]["node"]]["name"] == "LeftArm"


@pytest.mark.slow
def test_equal_motions_give_equal_bytes_and_one_pose_is_enough(motion: AnimatedSkeleton, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", motion, "a")
    write_glb(tmp_path / "b.glb", motion, "a")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    write_glb(tmp_path / "c.glb", motion_of(moving(3).rows(np.array([1]))), "one")
    file = pygltflib.GLTF2().load(str(tmp_path / "c.glb"))
    assert file.accessors[file.animations[0].samplers[0].input].count == 1
