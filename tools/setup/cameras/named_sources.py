"""Cameras that are filmed without a rig file, because there is no calibration yet: NAME=SOURCE."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Viewer
from zenocap.common.rig.source_kinds import named_source
from zenocap.common.rig.sources import Announced, MedianFrames, VideoFile, without_password

SUCH_AS = "cam01=/dev/video0 or cam02=rtsp://192.168.1.20/stream"


def named_sources(texts: Sequence[str], size: tuple[int, int], fps: float, *, files: bool = False) -> list[Viewer]:
    """Viewers of cameras and streams, of images of `size` (width, height) px.  texts: NAME=SOURCE.  Raises UserError.

    files: whether video files are allowed too, and cameras of other machines are not.  Their lens is a placeholder: they
    are for filming, the live page, and nothing else.
    """
    other = VideoFile if files else Announced
    width, height = size
    matrix = np.array([[width, 0.0, (width - 1) / 2], [0.0, width, (height - 1) / 2], [0.0, 0.0, 1.0]])
    viewers: list[Viewer] = []
    for text in texts:
        name, source = named_source(text, SUCH_AS)
        text = f"{name}={without_password(text.partition('=')[2])}"
        if not (source.live or isinstance(source, other)):
            raise UserError(
                f"{text}: no camera and no stream{' and no video' * files}: allowed: NAME=SOURCE, such as {SUCH_AS}"
            )
        if any(one.id == name or one.source == source for one in viewers):
            raise UserError(f"{text}: this name or this source was given already: allowed: each once")
        camera = Camera(name, size, matrix, np.zeros(4), np.eye(3), np.zeros(3))
        viewers.append(Viewer(name, camera, size, source, MedianFrames(), fps, preview=False, silhouette=False))
    return viewers
