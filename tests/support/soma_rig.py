"""Small rig in the file format of the SOMA body: an octahedron at each joint."""

import struct
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np

from benchmarks.soma import FACES, MOVING, RIG

SOLE_CM, TOP_CM, SMALL_CM = 0.0, 175.0, 3.0
_TRUNK_CM = {"Root": 90, "Hips": 100, "Spine1": 106, "Spine2": 113, "Chest": 120, "Neck1": 147, "Neck2": 154, "Head": 161}
_LIMBS_CM = {  # of the left side, T-pose
    "Shoulder": (2, 144, 0), "Arm": (16, 144, 0), "ForeArm": (45, 144, 0), "Hand": (72, 144, 0), "HandThumb1": (76, 144, 3),
    "Leg": (10, 93, 0), "Shin": (10, 50, 0), "Foot": (10, 7, 0), "ToeBase": (10, 3, 13),
}  # fmt: skip
_ABOVE = {"Shoulder": "Chest", "Leg": "Hips"}


def joints() -> tuple[list[str], list[int], np.ndarray]:
    """Names, index of the joint above each, and (b, 3) positions in centimetres."""
    names, parents, places = list(_TRUNK_CM), [-1, *range(len(_TRUNK_CM) - 1)], [(0, y, 0) for y in _TRUNK_CM.values()]
    names, parents, places = [*names, "HeadEnd"], [*parents, names.index("Head")], [*places, (0, TOP_CM, 0)]
    for side, sign in (("Left", 1), ("Right", -1)):
        before = ""
        for name, (x, y, z) in _LIMBS_CM.items():
            parents.append(names.index(_ABOVE.get(name, f"{side}{before}")))
            names.append(f"{side}{name}")
            places.append((sign * x, y, z))
            before = name
    return names, parents, np.array(places, dtype=np.float64)


def write_wheel(path: Path) -> Path:
    """Write the file that stands for the wheel."""
    names, parents, places = joints()
    corners = SMALL_CM * np.concatenate([np.eye(3), -np.eye(3)])
    points = (places[:, None] + corners).reshape(-1, 3)
    feet = [6 * k + 4 for k, name in enumerate(names) if name.endswith(("Foot", "ToeBase"))]
    points[feet, 1] = SOLE_CM  # the lowest corners
    eighths = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    faces = np.array([one if sum(one) % 2 else (one[0], one[2], one[1]) for one in eighths])  # all counterclockwise
    transforms = np.tile(np.eye(4), (len(names), 1, 1))
    transforms[:, :3, 3] = places
    arrays = {
        "bind_shape": points,
        "skinning_weights": np.repeat(np.eye(len(names)), 6, axis=0),
        "bind_world_transforms": transforms,
        "t_pose_world": transforms,
    }
    pairs = [_text(name) + _array(str(k), array) for k, (name, array) in enumerate(arrays.items())]
    pairs += [_text("bone_labels") + b"](" + b"".join(_text(name) for name in names) + b"e"]
    pairs += [_text("bone_parents") + b"](" + b"".join(_number(k) for k in parents) + b"e"]
    triangles = np.concatenate([faces + 6 * k for k in range(len(names))]).astype(np.int64)
    with zipfile.ZipFile(path, "w") as wheel:
        wheel.writestr(RIG, _file(b"}(" + b"".join(pairs) + b"u", list(arrays.values())))
        wheel.writestr(FACES, _file(_array("0", triangles), [triangles]))
    return path


def _file(content: bytes, arrays: list[np.ndarray]) -> bytes:
    out = BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("rig/data.pkl", b"\x80\x02" + content + b".")
        for k, array in enumerate(arrays):
            archive.writestr(f"rig/data/{k}", np.ascontiguousarray(array).tobytes())
    return out.getvalue()


def _array(key: str, array: np.ndarray) -> bytes:
    """Opcodes of a dense array, as PyTorch writes them."""
    kind = {"f": b"ctorch\nDoubleStorage\n", "i": b"ctorch\nLongStorage\n"}[array.dtype.kind]
    storage = b"(" + _text("storage") + kind + _text(key) + _text("cpu") + _number(array.size) + b"tQ"
    sizes, strides = ([_number(k) for k in values] for values in (array.shape, np.array(array.strides) // array.itemsize))
    shape = b"(" + b"".join(sizes) + b"t(" + b"".join(strides) + b"t"
    return b"ctorch._utils\n_rebuild_tensor_v2\n(" + storage + _number(0) + shape + b"\x89ccollections\nOrderedDict\n)RtR"


def _text(text: str) -> bytes:
    return b"X" + struct.pack("<I", len(text)) + text.encode()


def _number(number: int) -> bytes:
    return b"J" + struct.pack("<i", number)


assert {name for name in MOVING} <= set(joints()[0])
