"""Pictures rendered beforehand as a source of negligible cost, for load tests."""

from collections.abc import Iterator
from pathlib import Path
from tokenize import TokenError

import numpy as np

from zenocap.common.arrays import LARGEST_PX, Bytes
from zenocap.common.errors import AccessDenied, OpenError
from zenocap.common.rig.sources import Rendered
from zenocap.common.rig.viewers import Viewer
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit, fit_of


def frames_of(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    assert isinstance(viewer.source, Rendered)
    return rendered_frames(viewer.source, viewer.fps, fit_of(viewer), playback)


def rendered_frames(source: Rendered, fps: float, fit: Fit, playback: Playback) -> Iterator[Frame]:
    """Yield frame n with the time `epoch_ns` + n / fps.  Raises OpenError, AccessDenied, SizeMismatch.

    Live, the file is played forward and backward without end at its own rate, so that the motion is continuous; late frames
    are dropped.  Otherwise every picture of the file is yielded once, at most `fps` per second.
    """
    pictures, fit = opened(source.path), fit.named(source.path)
    index, count = 0, len(pictures)
    while playback.live or index * source.fps / fps < count:
        if playback.live:
            index = playback.next_index(index, fps)
            playback.wait_until(playback.time_of(index, fps))
        shown = there_and_back(int(index * source.fps / fps + 1e-6), count)
        yield Frame(index, playback.time_of(index, fps), fit(np.array(pictures[shown])))
        index += 1


def there_and_back(step: int, count: int) -> int:
    """Picture index of a step: 0, 1, ... count - 1, count - 2, ... 1, 0, 1, ..."""
    if count == 1:
        return 0
    step %= 2 * (count - 1)
    return min(step, 2 * (count - 1) - step)


def opened(path: Path) -> Bytes:
    """Memory map of the pictures of a file, (count, height, width, 3) uint8.  Raises as the source does."""
    try:
        pictures: Bytes = np.load(path, mmap_mode="r", allow_pickle=False)
    except PermissionError as error:
        raise AccessDenied(f"{path}: no permission to read this file") from error
    except (OSError, ValueError, EOFError, SyntaxError, TokenError) as error:
        raise OpenError(f"{path}: no NumPy file of pictures: {error}") from error
    if pictures.ndim != 4 or pictures.shape[3] != 3 or pictures.dtype != np.uint8 or not len(pictures):
        raise OpenError(f"{path}: {pictures.dtype} {pictures.shape}: allowed: uint8 (count, height, width, 3)")
    _, height, width, _ = pictures.shape
    if width * height > LARGEST_PX:
        raise OpenError(f"{path}: pictures of {width} x {height} px: allowed: at most {LARGEST_PX} pixels")
    return pictures
