"""Brightness and outlines of a video, for synchronization."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image
from zenocap.common.conversion import silhouette_mask
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import Outline, outline_of
from zenocap.common.messages import Silhouette
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import VideoFile
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Stepper
from zenocap.common.video.reader import VideoReader, until_cut
from zenocap.services.viewer.shell import silhouette_service
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source

CELLS = (8, 6)  # of the image, across and down


def from_its_beginning(rig: Rig, viewer: Viewer) -> Viewer:
    """The viewer without offset and without separate T-pose.  Raises UserError."""
    if not isinstance(viewer.source, VideoFile):
        raise UserError(f"rig {rig.name}: viewer {viewer.id} has no video file: allowed for sync: video files")
    return replace(viewer, source=replace(viewer.source, offset_ns=0, initial=None))


def outlines_of(
    viewers: Mapping[str, Viewer], seconds: float, on_frame: Callable[[int], None] = lambda _: None
) -> dict[str, list[Outline]]:
    """Outlines of the silhouettes of each viewer's video, segmented as for tracking.  Raises OpenError and others."""
    before, count = cv2.getNumThreads(), 0
    cv2.setNumThreads(1)
    found: dict[str, list[Outline]] = {}
    try:
        for id, viewer in viewers.items():
            stepper, outlines = Stepper(silhouette_service(viewer)), found.setdefault(id, [])
            frames = open_source(viewer, Playback(0, ManualClock(0), live=False))
            for frame in until_cut(frames):
                if frame.captured_ns > seconds * 1e9:
                    break
                for message in stepper.step(frame):
                    if isinstance(message, Silhouette) and message.data:
                        outline = outline_of(viewer.camera, silhouette_mask(message), frame.captured_ns / 1e9)
                        outlines += [outline] if outline is not None else []
                count += 1
                on_frame(count)
    finally:
        cv2.setNumThreads(before)
    return found


@dataclass(frozen=True)
class Brightness:
    """times_s: (n,) from the first frame on.  cells: (n, cells) mean grey level."""

    times_s: Floats
    cells: Floats


def brightness_of(image: Image) -> Floats:
    """(cells,) mean grey level of an image (height, width, 3)."""
    small = cv2.resize(image, CELLS, interpolation=cv2.INTER_AREA)
    return np.asarray(np.asarray(small, dtype=np.float64).mean(axis=2).ravel())


def brightness_in(path: Path, seconds: float) -> Brightness:
    """Brightness of the first `seconds` of a video.  Raises OpenError."""
    times, cells = [], []
    with VideoReader(path) as reader:
        for frame in until_cut(iter(reader.next, None)):
            if frame.time_ns > seconds * 1e9:
                break
            times.append(frame.time_ns / 1e9)
            cells.append(brightness_of(frame.image()))
    return Brightness(np.array(times), np.array(cells).reshape(len(times), -1))
