"""Silhouettes of the shared clips, computed once by the viewers' steps."""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import cv2
import numpy as np

from benchmarks.harness.case import SHARED
from tests.support.stored import stored
from zenocap.common.arrays import Bytes, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import read_trc
from zenocap.common.messages import Silhouette
from zenocap.common.rig.rig import Rig, Viewer, load_rig
from zenocap.common.rig.sources import VideoFile
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Stepper
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.shell import silhouette_service
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.inputs import Inputs
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import opened, tolerance_ns

TRUTHS = ("truth.trc", "reference.trc")  # of a rendered clip; of a real one, which is no ground truth


@dataclass(frozen=True)
class Instant:
    """frame: its number.  captured_ns: since frame 0; less than 0 in the video of the T-pose.

    masks: by viewer, packed, (rows, bytes) uint8.
    """

    frame: int
    captured_ns: int
    masks: Mapping[str, Bytes]


@dataclass(frozen=True)
class Clip:
    """cameras: by viewer, at the working size.  truth: metres.  motion_from: first scored frame."""

    name: str
    rig: Rig
    frame_ns: int
    instants: tuple[Instant, ...]
    truth: Trajectories
    motion_from: int

    @cached_property
    def cameras(self) -> dict[str, Camera]:
        return {viewer.id: viewer.camera for viewer in self.rig.viewers}

    def masks(self, instant: Instant, views: Iterable[str]) -> dict[str, Mask]:
        """(height, width) of 0 and 1, by viewer."""
        return {
            view: np.unpackbits(instant.masks[view], axis=1, count=self.cameras[view].size[0])
            for view in views
            if view in instant.masks
        }

    def of_views(self, views: Sequence[str]) -> "Clip":
        """The clip with a subset of its cameras; with all for an empty subset."""
        if not views:
            return self
        return replace(self, rig=replace(self.rig, viewers=tuple(v for v in self.rig.viewers if v.id in views)))


@lru_cache(maxsize=4)
def load_clip(name: str, size: tuple[int, int] | None = None, *, t_pose: bool = True) -> Clip:
    """A clip in `SHARED`; silhouettes are computed once for the same sources and videos.

    size: working size (width, height) px, default: the videos'.  t_pose: whether the separate video of the T-pose is shown,
    where there is one.  Raises UserError.
    """
    folder = SHARED / "clips" / name
    rig = at_working_size(load_rig(folder, "hybrid"), size, None)
    if not t_pose:
        rig = replace(rig, viewers=tuple(_without_t_pose(viewer) for viewer in rig.viewers))
    videos = [(path.name, path.stat().st_size) for path in sorted(folder.rglob("*.mp4"))]
    sources = (__name__, "zenocap.services.viewer")
    found = stored(lambda: tuple(silhouettes_of(rig)), name, size, t_pose, videos, rig.digest, sources=sources)
    truth = read_trc(next(folder / name for name in TRUTHS if (folder / name).is_file()))
    frame_ns = round(1e9 / max(viewer.fps for viewer in rig.viewers))
    return Clip(name, rig, frame_ns, found, truth, motion_from(name))


def clip_table(name: str) -> Mapping[str, object]:
    """Content of `clip.toml` of a clip."""
    return tomllib.loads((SHARED / "clips" / name / "clip.toml").read_text())


def motion_from(name: str) -> int:
    """First frame of the motion of a clip."""
    return int(str(clip_table(name).get("motion_from_frame", 0)))


def _without_t_pose(viewer: Viewer) -> Viewer:
    source = viewer.source
    return replace(viewer, source=replace(source, initial=None)) if isinstance(source, VideoFile) else viewer


def silhouettes_of(rig: Rig) -> Iterator[Instant]:
    """Silhouettes of all viewers, grouped by capture time as in `zenocap track`."""
    cv2.setNumThreads(1)
    clock = ManualClock(EPOCH_NS)
    steppers = {viewer.id: Stepper(silhouette_service(viewer)) for viewer in rig.viewers}
    inputs = Inputs()
    for frames in inputs.frame_sets(opened(rig, clock, inputs), tolerance_ns(rig)):
        masks: dict[str, Bytes] = {}
        for id, frame in frames.items():
            for message in steppers[id].step(frame):
                if isinstance(message, Silhouette):
                    masks[id] = np.packbits(unpack(message.size, message.region, message.data) != 0, axis=1)
        if masks:
            latest: Frame = max(frames.values(), key=lambda frame: frame.frame)
            yield Instant(latest.frame, min(f.captured_ns for f in frames.values()) - EPOCH_NS, masks)
    if inputs.problems:
        raise ValueError(f"rig {rig.name}: {'; '.join(inputs.problems)}")
