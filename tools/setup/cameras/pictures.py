"""A small picture of each camera, to see which is which."""

import re
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.video.v4l2.listing import FoundCamera
from zenocap.common.vision.pictures import small_picture

LONG_SIDE_PX = 480  # of the pictures; chosen by hand
WARM_UP = 15  # images that a camera's automatic exposure needs, about half a second; chosen by hand


def camera_image(camera: FoundCamera) -> Image | None:
    """An image of the camera after its exposure has settled; None when it gives none."""
    capture = cv2.VideoCapture(str(camera.path), cv2.CAP_V4L2)
    try:
        image: object = None
        for _ in range(WARM_UP):
            good, image = capture.read()
            if not good:
                return None
        return np.asarray(image, dtype=np.uint8)
    finally:
        capture.release()


def written_pictures(folder: Path, images: Mapping[str, Image]) -> dict[str, str]:
    """Write small pictures and return their paths, by the names of the cameras.  Raises UserError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--pictures {folder}: {error.strerror}: allowed: a folder that can be written") from error
    found: dict[str, str] = {}
    for name, image in images.items():
        path = folder / f"{_file_name(name)}.jpg"
        number = 2
        while str(path) in found.values():  # two streams of one host may get one name
            path, number = folder / f"{_file_name(name)}-{number}.jpg", number + 1
        if not cv2.imwrite(str(path), small_picture(image, LONG_SIDE_PX)):
            raise UserError(f"{path}: cannot be written: allowed: a folder that can be written")
        found[name] = str(path)
    return found


def _file_name(name: str) -> str:
    """`video0` of /dev/video0, `10.0.0.5-stream` of rtsp://10.0.0.5/stream."""
    plain = re.sub(r"^(/dev/|[a-z]+://)", "", name)
    return re.sub(r"[^A-Za-z0-9.]+", "-", plain).strip("-.")[:100] or "camera"
