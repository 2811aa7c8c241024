"""The pictures in which points are placed: one still image of each camera, until another is asked for."""

from collections.abc import Sequence

from zenocap.common.errors import UserError
from zenocap.common.web.broadcast import EncodedUpdate, encoded
from zenocap.tools.setup.cameras.streams import jpeg
from zenocap.tools.setup.page.camera import LiveCamera
from zenocap.tools.setup.page.parameters import STILL_JPEG_QUALITY, STILL_PX
from zenocap.tools.setup.page.point_messages import StillUpdate


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
            update = StillUpdate(name, width, height, jpeg(frame.image, STILL_PX, STILL_JPEG_QUALITY))
            found.append(encoded(f"still/{name}", update))
        return found
