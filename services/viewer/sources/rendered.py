"""Pictures rendered beforehand as a source that costs next to nothing: for measuring everything else."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.runtime.specs import Rendered
from services.viewer.sources.fit import Fit
from services.viewer.sources.frame import AccessDenied, Frame, OpenError, Playback, Size


def rendered_frames(source: Rendered, fps: float, calibrated: Size, working: Size, playback: Playback) -> Iterator[Frame]:
    """Frame n at `epoch_ns` + n / fps.  Raises OpenError, AccessDenied, SizeMismatch.

    Live, it goes on for ever, there and back through the file at the file's own pace, so that a motion never jumps;
    frames that are late are left out.  Otherwise every picture of the file once, `fps` of them per second at most.
    """
    pictures = opened(source.path)
    fit = Fit(str(source.path), calibrated, working)
    index, count = 0, len(pictures)
    while playback.live or index * source.fps / fps < count:
        if playback.live:
            index = max(index, int((playback.clock.now_ns() - playback.epoch_ns) * fps / 1e9))
            playback.wait_until(playback.time_of(index, fps))
        shown = there_and_back(int(index * source.fps / fps + 1e-6), count)
        yield Frame(index, playback.time_of(index, fps), fit(np.array(pictures[shown])))
        index += 1


def there_and_back(step: int, count: int) -> int:
    """0, 1, ... count - 1, count - 2, ... 1, 0, 1, ..."""
    if count == 1:
        return 0
    step %= 2 * (count - 1)
    return min(step, 2 * (count - 1) - step)


def opened(path: Path) -> NDArray[np.uint8]:
    """The pictures of a file, (count, height, width, 3) uint8, read when they are looked at.  Raises as the source does."""
    try:
        pictures: NDArray[np.uint8] = np.load(path, mmap_mode="r", allow_pickle=False)
    except PermissionError as error:
        raise AccessDenied(f"{path}: no permission to read this file") from error
    except (OSError, ValueError, EOFError) as error:
        raise OpenError(f"{path}: no NumPy file of pictures: {error}") from error
    if pictures.ndim != 4 or pictures.shape[3] != 3 or pictures.dtype != np.uint8 or not len(pictures):
        raise OpenError(f"{path}: {pictures.dtype} {pictures.shape}: allowed: uint8 (count, height, width, 3)")
    return pictures
