"""Numbered picture files as a source: `images/*.png`."""

import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.errors import AccessDenied, EndedEarly, OpenError
from zenocap.common.rig.sources import Images
from zenocap.common.rig.viewers import Viewer
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit, fit_of


def numbered(path: Path) -> tuple[tuple[int, str], ...]:
    """Sort key that places 9.png before 10.png."""
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name))


def frames_of(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """`image_frames` of a viewer."""
    assert isinstance(viewer.source, Images)
    return image_frames(viewer.source, viewer.fps, fit_of(viewer), playback)


def image_frames(source: Images, fps: float, fit: Fit, playback: Playback) -> Iterator[Frame]:
    """Yield the pictures in the order of their numbers, as a video of `fps` frames per second.  Raises SourceError."""
    shown = source.folder / source.pattern
    paths = sorted((path for path in source.folder.glob(source.pattern) if path.is_file()), key=numbered)
    if not paths:
        raise OpenError(f"{shown}: no file matches")
    first, begun = 0, False
    while True:
        for number, path in enumerate(paths):
            captured_ns = playback.time_of(first + number, fps)
            if playback.live:
                if not playback.wants(captured_ns):
                    continue
                if playback.clock.now_ns() - captured_ns > 1e9 / fps:
                    if begun:
                        playback.count_late()
                    continue
                playback.wait_until(captured_ns)
            try:
                content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
            except PermissionError as error:
                raise AccessDenied(f"{path}: no permission to read this picture") from error
            except OSError as error:
                raise EndedEarly(f"{path}: cannot be read: {error.strerror}") from error
            image = cv2.imdecode(content, cv2.IMREAD_COLOR) if content.size else None
            if image is None:
                raise EndedEarly(f"{path}: picture {number} of {len(paths)} cannot be decoded")
            begun = True
            yield Frame(first + number, captured_ns, fit.named(path)(np.asarray(image, dtype=np.uint8)))
        if not playback.loop:
            return
        first += len(paths)
