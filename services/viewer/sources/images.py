"""Picture files: one as an image; numbered ones as a source, `images/*.png`."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import LARGEST_PX, Image
from zenocap.common.errors import AccessDenied, EndedEarly, OpenError
from zenocap.common.rig.sources import Images
from zenocap.common.rig.viewers import Viewer
from zenocap.common.video.frame_times import timing_of
from zenocap.common.video.reader import EXIF_BYTES, MIRRORED, MIRRORS, VideoSummary, exif_orientation
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit, fit_of

SPARSEST = 10  # places in a sequence for each of its pictures, above which its numbers mean something else; by hand
LARGEST_BYTES = 4 * LARGEST_PX  # of a picture file, which may be without compression


def read_picture(path: Path, flags: int = cv2.IMREAD_COLOR) -> Image:
    """Image of a picture file, (height, width, 3); (height, width) with cv2.IMREAD_GRAYSCALE.

    Raises OpenError and AccessDenied, also for a file above LARGEST_BYTES and an image above LARGEST_PX.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_BYTES + 1)
    except PermissionError as error:
        raise AccessDenied(f"{path}: no permission to read this picture") from error
    except OSError as error:
        raise OpenError(f"{path}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST_BYTES:
        raise OpenError(f"{path}: a picture file of more than {LARGEST_BYTES >> 20} MiB: allowed: a smaller one")
    picture: cv2.typing.MatLike | None = None
    with suppress(cv2.error):  # nothing in it, or more pixels than OpenCV reads
        picture = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), flags)
    if picture is None or picture.shape[0] * picture.shape[1] > LARGEST_PX:
        allowed = f"PNG, JPEG or BMP of at most {LARGEST_PX} pixels"
        raise OpenError(f"{path}: not a picture that can be decoded: allowed: {allowed}")
    if (mirror := MIRRORS.get(exif_orientation(content))) is not None:
        picture = cv2.flip(picture, mirror)
    return np.asarray(picture, dtype=np.uint8)


def numbered(path: Path) -> tuple[tuple[int, str], ...]:
    """Sort key that places 9.png before 10.png."""
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name))


def places_of(paths: Sequence[Path]) -> tuple[list[int], list[str]]:
    """Places of pictures in their sequence, from the numbers in their names, and notes; numbers that are left out are gaps.

    paths: in the order of their numbers.  The last number that is not the same in all names counts, by its smallest step;
    where it does not rise by whole steps, as times of capture, the order is followed.
    """
    texts, order = [re.findall(r"\d+", path.stem) for path in paths], list(range(len(paths)))
    if len({len(one) for one in texts}) != 1:
        return order, ["not every name has a number: the pictures follow each other without gaps"]
    columns = [[int(one) for one in column] for column in zip(*texts, strict=True)]
    numbers = next((column for column in reversed(columns) if len(set(column)) > 1), None)
    if numbers is None:
        return order, []
    steps = [b - a for a, b in pairwise(numbers)]
    step = min(steps)
    if step < 1 or any(one % step for one in steps) or numbers[-1] - numbers[0] > SPARSEST * step * len(paths):
        return order, ["the numbers in the names do not rise by whole steps: the pictures follow each other without gaps"]
    notes = [f"begins with number {numbers[0]}: times count from that picture"] if numbers[0] > step else []
    return [(one - numbers[0]) // step for one in numbers], notes


def frames_of(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    assert isinstance(viewer.source, Images)
    return image_frames(viewer.source, viewer.fps, fit_of(viewer), playback)


def image_frames(source: Images, fps: float, fit: Fit, playback: Playback) -> Iterator[Frame]:
    """Yield the pictures at the times of their numbers, as a video of `fps` frames per second.  Raises SourceError."""
    shown = source.folder / source.pattern
    paths = sorted(source.files(), key=numbered)
    if not paths:
        raise OpenError(f"{shown}: no file matches")
    places, notes = places_of(paths)
    with suppress(OSError), paths[0].open("rb") as file:  # an error is that of reading the picture, below
        if exif_orientation(file.read(EXIF_BYTES)) in MIRRORS:
            notes.append(MIRRORED)
    if not source.rated:
        notes.insert(0, f"pictures have no times: {fps:g}/s assumed, unless `fps` of the rig file states it")
    first, begun = 0, False
    while True:
        for number, (place, path) in enumerate(zip(places, paths, strict=True)):
            captured_ns = playback.time_of(first + place, fps)
            if playback.live:
                if not playback.wants(captured_ns):
                    continue
                if playback.clock.now_ns() - captured_ns > 1e9 / fps:
                    if begun:
                        playback.count_late()
                    continue
                playback.wait_until(captured_ns)
            try:
                image = read_picture(path)
            except OpenError as error:
                raise EndedEarly(f"{error}; it is picture {number} of {len(paths)}") from error
            begun = True
            yield Frame(first + place, captured_ns, fit.named(path)(image))
        timing = timing_of([round(1e9 * place / fps) for place in places])
        playback.finished(VideoSummary(timing, damaged=0, estimated=0, notes=tuple(notes)))
        if not playback.loop:
            return
        first += places[-1] + 1
