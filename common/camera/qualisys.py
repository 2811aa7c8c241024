"""Calibration files of Qualisys Track Manager (`.qca.txt`, XML).

`transform` holds the camera's axes in the world, row by row in Qualisys' order (x right, y up, z backwards), and its
position in millimetres.  `intrinsic` is in 1/64 of a pixel, of the whole sensor.  The distortions are divided by 64 as
Pose2Sim does, which ignores `radialDistortion3`; that is read in the same unit and not written.  Other readers do not
divide: a note says so.  Cameras that are switched off, not calibrated or without video are left out.
"""

import re
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Z_UP_TO_Y_UP, Entry, checked_camera, checked_up_axis
from zenocap.common.errors import FileNote, UserError

SUBPIXELS = 64.0  # per pixel, in `intrinsic`
FALSE = ("0", "false", "no")
MARKER_MODEL = re.compile(r"(?:ProReflex|Oqus \d+|Miqus M\d|Arqus)\b(?!.*(?:video|hybrid))", re.IGNORECASE)  # not Oqus 210c
NO_VIDEO = ("", "none", "0", "0p")  # as its resolution
SOURCE = "zenocap"  # of files that this module writes
TURNED = "is shown turned (viewrotation): its calibration is taken as that of the video as recorded, not turned upright"
BINNED = 1.5  # height of the sensor to that of the video, from which its pixels are joined
TO_OPENCV = np.diag([1.0, -1.0, -1.0])


def read_qualisys(path: Path, up_axis: str = "z") -> dict[str, Camera]:
    """Return the cameras by serial number in the Y-up world.  Raises UserError."""
    checked_up_axis(path, up_axis)
    try:
        text = path.read_bytes()
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise UserError(f"{path}: has a document type or entities; allowed: plain XML elements")
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # also for an encoding that is unknown
        raise UserError(f"{path}: not XML: {error}") from error
    cameras: dict[str, Camera] = {}
    noted: dict[str, list[str]] = {}
    for element in root.iter("camera"):
        name = element.get("serial", "")
        if reason := _unusable(element):
            noted.setdefault(f"is {reason}: left out", []).append(name)
            continue
        if name in cameras:
            raise Entry(path, "camera").error("serial", repr(name), "a serial that no other camera has")
        cameras[name] = _camera(Entry(path, f"camera[{name}]"), name, element, up_axis)
        if element.get("viewrotation", "0") != "0":
            noted.setdefault(TURNED, []).append(name)
    notes = [f"camera {', '.join(names)} {note}" for note, names in noted.items()]
    if not cameras:
        raise UserError(f"{path}: {'; '.join(notes) or 'no camera in it'}: allowed: Qualisys calibration of videos")
    for note in notes:
        warnings.warn(f"{path}: {note}", FileNote, stacklevel=2)
    if root.get("source") != SOURCE and any(camera.distortions.any() for camera in cameras.values()):
        note = "the distortions are divided by 64, as the focal lengths are; programs differ in that"
        warnings.warn(f"{path}: {note}: compare a straight edge near the border of an image", FileNote, stacklevel=2)
    return cameras


def _unusable(element: ElementTree.Element) -> str:
    """Why a camera has no calibrated video, in words; empty for one that has."""
    if element.get("active", "1").lower() in FALSE:
        return "not active"
    if element.get("calibrated", "true").lower() in FALSE:
        return "not calibrated"
    model, part = element.get("model", ""), element.find("fov_video")
    if part is not None and {part.get("right"), part.get("bottom")} <= {"0", "0.0"}:
        return "without a part of its video (fov_video)"
    if "video_resolution" in element.attrib:
        return "a marker camera, without video" if element.get("video_resolution", "").lower() in NO_VIDEO else ""
    return f"a marker camera by its model {model}, without video_resolution" if MARKER_MODEL.match(model) else ""


def qualisys_texts(path: Path, cameras: Mapping[str, Camera], up_axis: str = "z") -> dict[Path, str]:
    """Content of the file for cameras in the Y-up world, their names as serials; up_axis: of the world in the file.

    The elements and attributes are those that Pose2Sim reads.  Raises UserError for a lens that the layout cannot hold.
    """
    root = ElementTree.Element("calibration", source=SOURCE, type="regular")
    ElementTree.SubElement(root, "results", {"std-dev": "0.0", "min-max-diff": "0.0"})
    every = ElementTree.SubElement(root, "cameras")
    for camera in cameras.values():
        if camera.fisheye is not None:
            raise UserError(f"{path}: camera {camera.name!r} has a fisheye lens: allowed in this layout: other lenses")
        lens = np.pad(camera.distortions, (0, max(0, 4 - len(camera.distortions))))
        if np.any(lens[4:]):
            text = f"a lens with {np.flatnonzero(lens)[-1] + 1} coefficients: allowed in this layout: the first 4"
            raise UserError(f"{path}: camera {camera.name!r} has {text}")
        element = ElementTree.SubElement(
            every, "camera",
            {"serial": camera.name, "active": "1", "model": "none", "avg-residual": "0.0", "viewrotation": "0"}
            | ({"guessed": " ".join(camera.guessed)} if camera.guessed else {}),
        )  # fmt: skip
        view = {"left": 0, "top": 0, "right": camera.size[0] - 1, "bottom": camera.size[1] - 1}
        for tag in ("fov_marker", "fov_marker_max", "fov_video", "fov_video_max"):
            ElementTree.SubElement(element, tag, {key: str(value) for key, value in view.items()})
        rotation = TO_OPENCV @ (camera.rotation @ Z_UP_TO_Y_UP if up_axis == "z" else camera.rotation)
        centre = 1000.0 * (Z_UP_TO_Y_UP.T @ camera.centre if up_axis == "z" else camera.centre)
        places = {f"r{i + 1}{j + 1}": float(rotation[i, j]) for i in range(3) for j in range(3)}
        places |= dict(zip(("x", "y", "z"), map(float, centre), strict=True))
        ElementTree.SubElement(element, "transform", {key: repr(value) for key, value in places.items()})
        matrix, (k1, k2, p1, p2) = SUBPIXELS * camera.matrix, map(float, SUBPIXELS * lens[:4])
        inner = {
            "focalLengthU": float(matrix[0, 0]),
            "focalLengthV": float(matrix[1, 1]),
            "centerPointU": float(matrix[0, 2]),
            "centerPointV": float(matrix[1, 2]),
            "radialDistortion1": k1,
            "radialDistortion2": k2,
            "radialDistortion3": 0.0,
            "tangentalDistortion1": p1,
            "tangentalDistortion2": p2,
            "skew": 0.0,
            "sensorMinU": 0.0,
            "sensorMaxU": SUBPIXELS * (camera.size[0] - 1),
            "sensorMinV": 0.0,
            "sensorMaxV": SUBPIXELS * (camera.size[1] - 1),
        }
        ElementTree.SubElement(element, "intrinsic", {key: repr(value) for key, value in inner.items()})
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return {path: f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"}


def _camera(entry: Entry, name: str, element: ElementTree.Element, up_axis: str) -> Camera:
    video = _numbers(entry, element, "fov_video", ("left", "top", "right", "bottom"))
    keys = ("focalLengthU", "focalLengthV", "centerPointU", "centerPointV", "radialDistortion1", "radialDistortion2")
    fu, fv, cu, cv, k1, k2 = _numbers(entry, element, "intrinsic", keys)
    p1, p2 = _numbers(entry, element, "intrinsic", ("tangentalDistortion1", "tangentalDistortion2"))  # Qualisys' spelling
    k3 = _numbers(entry, element, "intrinsic", ("radialDistortion3",), missing="0")
    transform = ("r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33", "x", "y", "z")
    numbers = _numbers(entry, element, "transform", transform)
    rotation, centre = TO_OPENCV @ numbers[:9].reshape(3, 3), numbers[9:] / 1000.0
    matrix = np.array([[fu, 0.0, cu], [0.0, fv, cv], [0.0, 0.0, 1.0]])
    matrix[:2] /= SUBPIXELS * (binned := _binning(entry, element, video))
    matrix[:2, 2] += 0.5 / binned - 0.5 - video[:2]  # centres of pixels are whole numbers; left and top are the video's
    size = [video[2] - video[0] + 1, video[3] - video[1] + 1]
    lens = np.array([k1, k2, p1, p2, *(k3 if k3.any() else ())]) / SUBPIXELS
    guessed = element.get("guessed", "").split()
    return checked_camera(entry, name, size, matrix, lens, rotation, -rotation @ centre, up_axis, guessed=guessed)


def _binning(entry: Entry, element: ElementTree.Element, video: Floats) -> float:
    """Pixels of the sensor in a pixel of the video, in a row.  video: left, top, right, bottom, px.

    A smaller part of the sensor is a crop, unless the resolution names a half, a third, ... of its height.  A video that
    is higher than its resolution gives a note.  Raises UserError.
    """
    named = re.fullmatch(r"([1-9]\d*)p", element.get("video_resolution", ""))
    low, high = _numbers(entry, element, "intrinsic", ("sensorMinV", "sensorMaxV"), missing="0")
    sensor, height = (high - low) / SUBPIXELS, video[3] - video[1] + 1
    if named is not None and height > BINNED * int(named[1]):
        text = f"fov_video is {height:.0f} px high, video_resolution = {named[0]}: the former is used"
        warnings.warn(f"{entry.path}: {entry.key}: {text}", FileNote, stacklevel=2)
    if named is None or height < 1 or sensor < BINNED * height:
        return 1.0
    for whole in (float(named[1]), height):
        if abs(sensor / whole - (binned := round(sensor / whole))) < 0.03:
            return float(max(binned, 1))
    text = f"{height:.0f} px high of a sensor of {sensor:.0f}"
    raise entry.error("fov_video", text, "the whole height, or 1/2, 1/3, ... of it")


def _numbers(
    entry: Entry, element: ElementTree.Element, tag: str, keys: tuple[str, ...], missing: str | None = None
) -> Floats:
    """The attributes `keys` of a child.  missing: value of those that are not there; None: an error."""
    child = element.find(tag)
    if child is None:
        raise entry.missing(tag, [found.tag for found in element])
    values = []
    for key in keys:
        text = child.get(key, missing)
        if text is None:
            raise entry.missing(f"{tag}.{key}", child.keys())
        try:
            values.append(float(text))
        except ValueError:
            raise entry.error(f"{tag}.{key}", repr(text), "a number") from None
    return entry.numbers(tag, values, (len(keys),))
