"""Calibration files of Qualisys Track Manager (`.qca.txt`, XML), read only.

`transform` holds the camera's axes in the world, row by row in Qualisys' order (x right, y up, z backwards), and its
position in millimetres; `intrinsic` is in 1/64 of a pixel, the distortions as Pose2Sim has them.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Entry, checked_camera, checked_up_axis
from zenocap.common.errors import UserError

SUBPIXELS = 64.0  # per pixel, in `intrinsic`
TO_OPENCV = np.diag([1.0, -1.0, -1.0])


def read_qualisys(path: Path, up_axis: str = "z") -> dict[str, Camera]:
    """Return the cameras by serial number in the Y-up world.  Raises UserError."""
    checked_up_axis(path, up_axis)
    try:
        text = path.read_bytes()
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise UserError(f"{path}: has a document type or entities; allowed: plain XML elements")
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise UserError(f"{path}: not XML: {error}") from error
    cameras: dict[str, Camera] = {}
    for element in root.iter("camera"):
        name = element.get("serial", "")
        if name in cameras:
            raise Entry(path, "camera").error("serial", repr(name), "a serial that no other camera has")
        cameras[name] = _camera(Entry(path, f"camera[{name}]"), name, element, up_axis)
    if not cameras:
        raise UserError(f"{path}: no camera in it: allowed: Qualisys calibration with <camera serial=...>")
    return cameras


def _camera(entry: Entry, name: str, element: ElementTree.Element, up_axis: str) -> Camera:
    video = _numbers(entry, element, "fov_video", ("left", "top", "right", "bottom"))
    keys = ("focalLengthU", "focalLengthV", "centerPointU", "centerPointV", "radialDistortion1", "radialDistortion2")
    fu, fv, cu, cv, k1, k2 = _numbers(entry, element, "intrinsic", keys)
    tangential = ("tangentalDistortion1", "tangentalDistortion2")  # Qualisys' spelling
    p1, p2 = _numbers(entry, element, "intrinsic", tangential)
    transform = ("r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33", "x", "y", "z")
    numbers = _numbers(entry, element, "transform", transform)
    rotation, centre = TO_OPENCV @ numbers[:9].reshape(3, 3), numbers[9:] / 1000.0
    matrix = np.array([[fu, 0.0, cu - SUBPIXELS * video[0]], [0.0, fv, cv - SUBPIXELS * video[1]], [0.0, 0.0, 1.0]])
    matrix[:2] /= SUBPIXELS
    size = [video[2] - video[0] + 1, video[3] - video[1] + 1]
    lens = np.array([k1, k2, p1, p2]) / SUBPIXELS
    return checked_camera(entry, name, size, matrix, lens, rotation, -rotation @ centre, up_axis)


def _numbers(entry: Entry, element: ElementTree.Element, tag: str, keys: tuple[str, ...]) -> Floats:
    child = element.find(tag)
    if child is None:
        raise entry.missing(tag, [found.tag for found in element])
    values = []
    for key in keys:
        text = child.get(key)
        if text is None:
            raise entry.missing(f"{tag}.{key}", child.keys())
        try:
            values.append(float(text))
        except ValueError:
            raise entry.error(f"{tag}.{key}", repr(text), "a number") from None
    return entry.numbers(tag, values, (len(keys),))
