"""The pictures in which points are placed: one still image of each camera, until another is asked for."""

from collections.abc import Sequence

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.web.broadcast import EncodedUpdate, encoded
from zenocap.tools.live.camera import LiveCamera
from zenocap.tools.live.parameters import STILL_JPEG_QUALITY, STILL_PX
from zenocap.tools.live.point_messages import StillUpdate


class Stills:
    """sizes: (width, height) px of the pictures so far, by camera."""

    def __init__(self, cameras: Sequence[LiveCamera]) -> None:
        self._cameras = {camera.name: camera for camera in cameras}
        self._asked = set(self._cameras)
        self.sizes: dict[str, tuple[int, int]] = {}

    def ask(self, name: str) -> None:
        """Take the newest image of a camera as its picture.  Raises UserError."""
        if name not in self._cameras:
            raise UserError(f"{name}: no such camera; there are: {', '.join(self._cameras)}")
        if self._cameras[name].newest is None:
            raise UserError(f"{name}: no image yet: {self._cameras[name].problem}")
        self._asked.add(name)

    def due(self) -> list[EncodedUpdate]:
        """Pictures that were asked for and have come."""
        found = []
        for name in sorted(self._asked):
            if (frame := self._cameras[name].newest) is None:
                continue
            self._asked.discard(name)
            height, width = frame.image.shape[:2]
            self.sizes[name] = width, height
            update = StillUpdate(name, width, height, _encoded(frame.image))
            found.append(encoded(f"still/{name}", update))
        return found


def _encoded(image: Image) -> bytes:
    """JPEG of an image, reduced only where it is larger than a browser can show."""
    scale = STILL_PX / max(image.shape[:2])
    if scale < 1.0:
        image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    good, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, STILL_JPEG_QUALITY])
    assert good
    return np.asarray(data, dtype=np.uint8).tobytes()
