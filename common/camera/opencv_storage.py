"""Files of OpenCV's FileStorage (YAML, XML): EasyMocap's calibrations, matrices.

EasyMocap: `intri.yml` has K_name and dist_name, `extri.yml` R_name or Rot_name and T_name: world to camera, metres.
`extri.yml` is the file to name; `intri.yml` is beside it.
"""

import codecs
import json
import re
import sys
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera, rodrigues
from zenocap.common.camera.validation import Z_UP_TO_Y_UP, Entry, checked_camera, checked_rotation, checked_up_axis
from zenocap.common.errors import FileNote, UserError, reading
from zenocap.common.formats.text_file import read_apart

WITH_POSITION = "allowed: a calibration with rotation and translation; zenocap calibrate --help shows how to make one"
MAX_YAML_BYTES = 1 << 20  # of a file of matrices of a few numbers; chosen by hand
MAX_MATRIX_SIDE = 1000  # rows or columns declared; calibrations have up to 14; chosen by hand
USUAL_SIZES = ((640, 480), (1280, 720), (1280, 960), (1280, 1024), (1920, 1080), (2048, 2048), (3840, 2160))  # px
GUESSED = "guessed_"  # beginning of a key: "guessed_vertical: 1"; a guessed size is left out instead
SAME_TURN_DEG = 0.1  # by rounding; chosen by hand
NEAR_SIZE = 0.03  # of a side, between a guess and such a size; principal points are that near the centre; chosen by hand


def read_opencv(path: Path, up_axis: str = "y") -> dict[str, Camera]:
    """Return the cameras by name in the Y-up world.  Raises UserError."""
    checked_up_axis(path, up_axis)
    beside = intrinsics_beside(path)
    listed, extrinsics = _stored(path)
    intrinsics = extrinsics if beside == path else stored_matrices(beside)
    names = [key[2:] for key in extrinsics if key.startswith("T_")]
    if not names and {"camera_matrix", "Camera_Matrix"} & set(extrinsics):
        raise UserError(f"{path}: has intrinsics only, no position and orientation; {WITH_POSITION}")
    if not names:
        allowed = "extri.yml with T_name and Rot_name for each camera, intri.yml beside it with K_name and dist_name"
        raise UserError(f"{path}: no camera in it: there are: {', '.join(extrinsics) or 'none'}; allowed: {allowed}")
    if listed and set(listed) != set(names):
        text = f"names = {', '.join(listed)}, but T_ is that of {', '.join(names)}: the latter are read"
        warnings.warn(f"{path}: {text}", FileNote, stacklevel=2)
    return {name: _camera(path, beside, name, extrinsics, intrinsics, up_axis) for name in names}


def intrinsics_beside(path: Path) -> Path:
    """The file of the intrinsics that belongs to one of extrinsics."""
    return path.with_name(path.name.replace("extri", "intri"))


def _camera(
    path: Path, beside: Path, name: str, extrinsics: dict[str, Floats], intrinsics: dict[str, Floats], up_axis: str
) -> Camera:
    intrinsic = Entry(beside, "")
    intrinsic.require((f"K_{name}", f"dist_{name}"), intrinsics)
    rotation = _rotation(path, name, extrinsics)
    matrix = intrinsics[f"K_{name}"]
    guessed: tuple[str, ...] = ()
    size = np.array([intrinsics.get(f"{side}_{name}", np.zeros(1)).item() for side in "WH"])
    if matrix.shape != (3, 3):
        raise intrinsic.error(f"K_{name}", matrix.tolist(), "3 x 3 finite numbers")
    if not size.any():
        # EasyMocap omits the size, or writes 0: a principal point near the centre is assumed.
        size = _usual_size(2 * matrix[:2, 2] + 1)
        guessed = ("size",)
        text = f"no W_{name} and H_{name}: {size[0]:.0f} x {size[1]:.0f} px is a guess from the principal point"
        warnings.warn(f"{beside}: {text}; add the size of the video", FileNote, stacklevel=2)
    lens, shift = intrinsics[f"dist_{name}"].reshape(-1), extrinsics[f"T_{name}"].reshape(-1)
    marked = [key.removeprefix(GUESSED) for key in extrinsics if key.startswith(GUESSED)]
    camera = checked_camera(Entry(path, name), name, size, matrix, lens, rotation, shift, up_axis, guessed=marked)
    return replace(camera, guessed=(*guessed, *camera.guessed))


def _rotation(path: Path, name: str, extrinsics: Mapping[str, Floats]) -> Floats:
    """R_name, which EasyMocap and Pose2Sim read, or Rot_name; a contradiction is a note.  Raises UserError."""
    keys = [key for key in (f"R_{name}", f"Rot_{name}") if key in extrinsics]
    if not keys:
        raise Entry(path, "").missing(f"Rot_{name}", extrinsics)
    found = [checked_rotation(Entry(path, key), np.squeeze(extrinsics[key])) for key in keys]
    turn = float(np.degrees(np.linalg.norm(rodrigues(found[0] @ found[-1].T))))
    if turn > SAME_TURN_DEG:
        text = f"{keys[0]} and {keys[1]} are {turn:.1f} degrees apart: {keys[0]} is used, as other programs do"
        warnings.warn(f"{path}: {text}", FileNote, stacklevel=2)
    return found[0]


def _usual_size(guess: Floats) -> Floats:
    """The nearest usual size of a video, also upright; the guess itself, (2,) px, where none is near.

    And where it is the size of whole even sides: the centre was not estimated.
    """
    if not np.any(guess % 2):
        return guess
    sizes = np.array([side[::step] for side in USUAL_SIZES for step in (1, -1)], dtype=np.float64)
    off = np.abs(guess / sizes - 1.0).max(axis=1)
    return np.asarray(sizes[np.argmin(off)] if off.min() < NEAR_SIZE else np.round(guess))


def easymocap_texts(path: Path, cameras: Mapping[str, Camera], up_axis: str = "y") -> dict[Path, str]:
    """Content of `extri.yml` at `path` and of `intri.yml` for cameras in the Y-up world; up_axis: of that in the files.

    Raises UserError, also for a lens that the layout cannot hold.
    """
    if (beside := intrinsics_beside(path)) == path:
        raise UserError(f"{path}: allowed: a name with extri in it, such as extri.yml; intri.yml is written beside it")
    storages = [cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY) for _ in range(2)]
    for storage in storages:
        storage.startWriteStruct("names", cv2.FILE_NODE_SEQ)
        for camera in cameras.values():
            storage.write("", camera.name)
        storage.endWriteStruct()
    extrinsics, intrinsics = storages
    for camera in cameras.values():
        if not re.fullmatch(r"[A-Za-z0-9_-]+", camera.name):
            raise UserError(f"{path}: camera {camera.name!r}: allowed in this layout: letters, digits, - and _")
        if camera.fisheye is not None:
            raise UserError(f"{path}: camera {camera.name!r} has a fisheye lens: allowed in this layout: other lenses")
        rotation = camera.rotation @ Z_UP_TO_Y_UP if up_axis == "z" else camera.rotation
        intrinsics.write(f"K_{camera.name}", camera.matrix)
        intrinsics.write(f"dist_{camera.name}", camera.distortions.reshape(1, -1))
        if "size" in camera.guessed:
            intrinsics.writeComment(f"W_{camera.name} and H_{camera.name} are left out: the size was a guess")
        else:
            intrinsics.write(f"W_{camera.name}", camera.size[0])
            intrinsics.write(f"H_{camera.name}", camera.size[1])
        extrinsics.write(f"R_{camera.name}", rodrigues(rotation).reshape(3, 1))
        extrinsics.write(f"Rot_{camera.name}", rotation)
        extrinsics.write(f"T_{camera.name}", camera.translation.reshape(3, 1))
    for guess in sorted({one for camera in cameras.values() for one in camera.guessed} - {"size"}):
        extrinsics.write(GUESSED + guess, 1)
    return {path: extrinsics.releaseAndGetString(), beside: intrinsics.releaseAndGetString()}


def stored_matrices(path: Path) -> dict[str, Floats]:
    """The matrices and numbers, (1,), of a file by their keys.  Raises UserError."""
    return _stored(path)[1]


def _stored(path: Path) -> tuple[list[str], dict[str, Floats]]:
    """EasyMocap's list of names, and as `stored_matrices`.  Raises UserError."""
    if not path.exists():
        raise UserError(f"{path}: no such calibration file; allowed: extri.yml with intri.yml beside it")
    _check_storage(path)
    names, found = json.loads(read_apart(path, "OpenCV FileStorage (%YAML:1.0)", __name__))
    return names, {key: np.array(value, dtype=np.float64) for key, value in found.items()}


def main() -> None:
    """Write names and matrices of the file that is named on the command line to the standard output, as JSON.

    In a process of its own (`read_apart`): OpenCV's parser writes beyond its memory for damaged files.
    """
    try:
        content, mode = Path(sys.argv[1]).read_bytes(), cv2.FILE_STORAGE_READ
        if content.startswith(codecs.BOM_UTF8):  # which OpenCV does not know
            storage = cv2.FileStorage(content.decode("utf-8-sig"), mode | cv2.FILE_STORAGE_MEMORY)
        else:
            storage = cv2.FileStorage(sys.argv[1], mode)
        root = storage.root()
        found = {key: _value(root.getNode(key)) for key in root.keys()}  # noqa: SIM118  (not a dict)
        listed = root.getNode("names")
        each = [listed.at(k) for k in range(listed.size())] if listed.isSeq() else []
        names = [node.string() for node in each if node.isString()]
    except (cv2.error, SystemError, UnicodeDecodeError) as error:
        sys.exit(" ".join(f"{error}".split()))
    print(json.dumps((names, {key: value.tolist() for key, value in found.items() if value is not None})))


def is_storage(path: Path) -> bool:
    """Whether a file begins as OpenCV's FileStorage does, in YAML or XML.  Raises OSError."""
    with path.open("rb") as file:
        begin = file.read(256).removeprefix(codecs.BOM_UTF8)
    return begin.startswith(b"%YAML") or b"<opencv_storage>" in begin


def _value(node: cv2.FileNode) -> Floats | None:
    if node.isMap():
        matrix = node.mat()
        return None if matrix is None else np.asarray(matrix, dtype=np.float64)
    return np.array([node.real()]) if node.isReal() or node.isInt() else None


def _check_storage(path: Path) -> None:
    """Refuse what makes OpenCV's parser take unlimited time or memory."""
    with reading(path), path.open("rb") as file:
        content = file.read(MAX_YAML_BYTES + 1)
    if len(content) > MAX_YAML_BYTES:
        raise UserError(f"{path}: more than {MAX_YAML_BYTES} bytes: allowed: a calibration file below that")
    if binary := re.search(rb"!!binary|!<[^>\n]*binary|\$base64\$", content):
        raise UserError(f"{path}: {binary.group().decode(errors='replace')[:40]}: allowed: matrices of numbers as text")
    for key, count in re.findall(rb"\b(rows|cols)\W{1,9}(\d+)", content):
        if len(count) > 4 or int(count) > MAX_MATRIX_SIDE:
            found = f"{key.decode()}: {count[:20].decode()}"
            raise UserError(f"{path}: {found}: allowed: matrices with up to {MAX_MATRIX_SIDE} rows and columns")


if __name__ == "__main__":
    main()
