"""Intrinsics in ROS' `camera_info` files, in the block layout that ROS' camera_calibration writes.

No YAML library is needed for that layout.  A file has one camera and no position.
"""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path

from zenocap.common.camera.lens import SIZE_GUESS, Lens
from zenocap.common.camera.opencv_storage import WITH_POSITION
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Entry, checked_distortions, checked_matrix, checked_size
from zenocap.common.errors import FileNote, UserError

FISHEYE_MODEL = "equidistant"
LENS_MODELS = ("plumb_bob", "rational_polynomial", FISHEYE_MODEL)
GUESSED_SIZE = "# image_width and image_height are a guess\n"  # written before them; a lens has no other guesses
ECHOED = re.compile(r"^distortion_model:.*^[kK]:", re.MULTILINE | re.DOTALL)
NEEDED_KEYS = ("image_width", "image_height", "camera_name", "distortion_model", "camera_matrix", "distortion_coefficients")


def is_ros_info(path: Path) -> bool:
    """Whether a YAML file has the keys of a ROS `camera_info`, as a file or as `ros2 topic echo` prints the message."""
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    return not text.startswith("%YAML") and ("image_width" in text or ECHOED.search(text) is not None)


def read_ros_info(path: Path) -> Lens:
    """Return the intrinsics in a ROS `camera_info` file, or of the first message of an echo.  Raises UserError."""
    text, entry = path.read_text(encoding="utf-8-sig", errors="replace"), Entry(path, "")
    if "image_width" not in text:
        text = _of_echo(text, path.stem)
    scalars = dict(re.findall(r"^(\w+):[ \t]*(\S+)[ \t]*$", text, re.MULTILINE))
    lists = dict(re.findall(r"^(\w+):\s*\n(?:[ \t]+\w+:[^\[\n]*\n)*[ \t]+data:\s*\[([^\]]*)\]", text, re.MULTILINE))
    found = scalars | lists
    _check_whole(entry, scalars, text)
    entry.require(NEEDED_KEYS, found)
    if scalars["distortion_model"] not in LENS_MODELS:
        raise entry.error("distortion_model", scalars["distortion_model"], " or ".join(LENS_MODELS))
    size = checked_size(entry, [_number(entry, key, scalars[key]) for key in ("image_width", "image_height")])
    if GUESSED_SIZE in text:
        what = f"image_width and image_height, {size[0]} x {size[1]} px, are a guess"
        warnings.warn(f"{path}: {what}: write the size of the video, and remove the comment", FileNote, stacklevel=2)
    matrix = entry.numbers("camera_matrix", _row(entry, "camera_matrix", lists["camera_matrix"]), (9,)).reshape(3, 3)
    matrix, key = checked_matrix(entry, matrix, size), "distortion_coefficients"
    fisheye = scalars["distortion_model"] == FISHEYE_MODEL
    distortions = checked_distortions(entry, _row(entry, key, lists[key]), size, matrix, fisheye=fisheye, key=key)
    guessed = (SIZE_GUESS,) if GUESSED_SIZE in text else ()
    return Lens(scalars["camera_name"], size, matrix, distortions, fisheye, guessed)


def no_cameras(path: Path, up_axis: str) -> dict[str, Camera]:
    """Raises UserError: that of the file itself first, else since it has no position."""
    read_ros_info(path)
    raise UserError(f"{path}: camera_info has intrinsics only, no position and orientation; {WITH_POSITION}")


def ros_texts(path: Path, cameras: Mapping[str, Camera], up_axis: str) -> dict[Path, str]:
    """A file of each camera in a folder, which is made.  Raises OSError."""
    path.mkdir(parents=True, exist_ok=True)
    return {path / f"{name}.yaml": ros_info_text(Lens.of(camera)) for name, camera in cameras.items()}


def ros_info_text(lens: Lens) -> str:
    """Content of a `camera_info` file of a lens."""
    model = FISHEYE_MODEL if lens.fisheye else LENS_MODELS[len(lens.distortions) > 5]
    fx, _, cx, _, fy, cy, *_ = lens.matrix.ravel().tolist()
    projection = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]

    def matrix(name: str, rows: int, values: list[float]) -> str:
        return f"{name}:\n  rows: {rows}\n  cols: {len(values) // rows}\n  data: {values}\n"

    return (
        (GUESSED_SIZE if SIZE_GUESS in lens.guessed else "")
        + f"image_width: {lens.size[0]}\nimage_height: {lens.size[1]}\ncamera_name: {lens.name}\n"
        + matrix("camera_matrix", 3, lens.matrix.ravel().tolist())
        + f"distortion_model: {model}\n"
        + matrix("distortion_coefficients", 1, lens.distortions.tolist())
        + matrix("rectification_matrix", 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
        + matrix("projection_matrix", 3, projection)
    )


def _check_whole(entry: Entry, scalars: Mapping[str, str], text: str) -> None:
    """Raise UserError for a matrix of a whole image beside a smaller one."""
    for key in ("binning_x", "binning_y"):
        if (binning := scalars.get(key, "0").strip("'\"")) not in ("0", "1"):
            raise entry.error(key, binning, "0 or 1: the matrix is that of all pixels")
    roi = dict(re.findall(r"(?<=[\s{,])(x_offset|y_offset|height|width):[ \t]*(\d+)", text.partition("\nroi:")[2]))
    size = [int(scalars[key]) for key in ("image_width", "image_height") if scalars.get(key, "").isdigit()]
    given = [int(roi.get(key, "0")) for key in ("x_offset", "y_offset", "width", "height")]
    if any(given) and given != [0, 0, *size]:
        raise entry.error("roi", " ".join(f"{key} {value}" for key, value in roi.items()), "none, or the whole image")


def _of_echo(text: str, name: str) -> str:
    """The first message of `ros2 topic echo` or `rostopic echo`, as a file.  name: of the camera without frame_id."""
    message = re.split(r"^---", text.removeprefix("---"), maxsplit=1, flags=re.MULTILINE)[0]
    message = re.sub(
        r"^[ \t]*frame_id:[ \t]*['\"]?([^'\"\n]*)['\"]?[ \t]*$", r"camera_name: \1", message, flags=re.MULTILINE
    )
    message = re.sub(r"^(camera_name:)[ \t]*$", rf"\1 {name}", message, flags=re.MULTILINE)
    message = re.sub(r"^(height|width):", r"image_\1:", message, flags=re.MULTILINE)
    message = re.sub(r"^distortion_model:[ \t]*['\"](\w*)['\"]", r"distortion_model: \1", message, flags=re.MULTILINE)
    for key, letters in (("camera_matrix", "kK"), ("distortion_coefficients", "dD")):
        listed = rf"^[{letters}]:[ \t]*(?:\[([^\]]*)\]|((?:\n[ \t]*-[ \t]+\S+)+))"
        if found := re.search(listed, message, re.MULTILINE):
            numbers = ", ".join((found[1] or re.sub(r"\n[ \t]*-[ \t]+", " ", found[2])).replace(",", " ").split())
            message += f"\n{key}:\n  data: [{numbers}]\n"
    return message


def _row(entry: Entry, key: str, text: str) -> list[float]:
    return [_number(entry, key, word) for word in text.replace(",", " ").split()]


def _number(entry: Entry, key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise entry.error(key, repr(text), "a number") from None
