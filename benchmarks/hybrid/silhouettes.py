"""Silhouettes of the shared clips, computed once by the viewers' steps."""

import hashlib
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Bytes, Ints, Mask
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
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.recordings.inputs import Inputs
from zenocap.tools.recordings.rig_changes import at_working_size
from zenocap.tools.recordings.track import tolerance_ns

VIEWER_CODE = ("common/vision", "common/camera", "services/viewer")
TRUTHS = ("truth.trc", "reference.trc")  # of a rendered clip; of a real one, which is no ground truth
ROOT = Path(__file__).resolve().parents[2]


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
    """cameras: by viewer, at the working size.  truth: metres.  motion_from: first scored frame.

    motion: file that drove it, excluded from training.
    """

    name: str
    rig: Rig
    frame_ns: int
    instants: tuple[Instant, ...]
    truth: Trajectories
    motion_from: int
    motion: str

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


def load_clip(folder: Path, cache: Path, size: tuple[int, int] | None = None, *, t_pose: bool = True) -> Clip:
    """Clip of a folder; silhouettes are read from `cache` if computed by the same code from the same files.

    size: working size (width, height) px, default: the videos'.  t_pose: whether the separate video of the T-pose is shown,
    where there is one.  Raises UserError.
    """
    rig = at_working_size(load_rig(folder, "hybrid"), size, None)
    if not t_pose:
        rig = replace(rig, viewers=tuple(_without_t_pose(viewer) for viewer in rig.viewers))
    table = _table(folder)
    path = cache / f"{folder.name}-{_digest(rig)}.npz"
    if not path.is_file():
        cache.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.npz")
        np.savez_compressed(part, allow_pickle=False, **_arrays(_silhouettes(rig)))
        part.replace(path)
    with np.load(path) as arrays:
        found = tuple(_instants({name: arrays[name] for name in arrays.files}))
    truth = read_trc(next(folder / name for name in TRUTHS if (folder / name).is_file()))
    frame_ns = round(1e9 / max(viewer.fps for viewer in rig.viewers))
    return Clip(folder.name, rig, frame_ns, found, truth, int(table.get("motion_from_frame", 0)), str(table["motion"]))


def _without_t_pose(viewer: Viewer) -> Viewer:
    source = viewer.source
    return replace(viewer, source=replace(source, initial=None)) if isinstance(source, VideoFile) else viewer


def _table(folder: Path) -> dict[str, str | int | float]:
    return dict(tomllib.loads((folder / "clip.toml").read_text()))


def _silhouettes(rig: Rig) -> Iterator[Instant]:
    """Silhouettes of all viewers, grouped by capture time as in `zenocap track`."""
    cv2.setNumThreads(1)
    clock = ManualClock(EPOCH_NS)
    steppers = {viewer.id: Stepper(silhouette_service(viewer)) for viewer in rig.viewers}
    sources = {viewer.id: open_source(viewer, Playback(EPOCH_NS, clock, live=False)) for viewer in rig.viewers}
    inputs = Inputs()
    for frames in inputs.frame_sets(sources, tolerance_ns(rig)):
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


def _arrays(found: Iterable[Instant]) -> dict[str, Ints | Bytes]:
    every = list(found)
    arrays: dict[str, Ints | Bytes] = {
        "frame": np.array([instant.frame for instant in every]),
        "captured_ns": np.array([instant.captured_ns for instant in every]),
    }
    for view in {view: None for instant in every for view in instant.masks}:
        rows = [k for k, instant in enumerate(every) if view in instant.masks]
        arrays[f"rows:{view}"] = np.array(rows)
        arrays[f"masks:{view}"] = np.stack([every[k].masks[view] for k in rows])
    return arrays


def _instants(arrays: Mapping[str, Ints | Bytes]) -> Iterator[Instant]:
    views = [name.removeprefix("rows:") for name in arrays if name.startswith("rows:")]
    where = {view: {int(row): k for k, row in enumerate(arrays[f"rows:{view}"])} for view in views}
    for row, (frame, captured_ns) in enumerate(zip(arrays["frame"], arrays["captured_ns"], strict=True)):
        masks = {
            view: np.asarray(arrays[f"masks:{view}"][where[view][row]], np.uint8) for view in views if row in where[view]
        }
        yield Instant(int(frame), int(captured_ns), masks)


def _digest(rig: Rig) -> str:
    """Digest of what the silhouettes depend on: the viewers' code, the rig's viewers, and its videos by size."""
    digest = hashlib.sha256(repr(rig.viewers).encode())
    for folder in VIEWER_CODE:
        for path in sorted((ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    for path in sorted(rig.base.rglob("*.mp4")):
        digest.update(f"{path.name} {path.stat().st_size}".encode())
    return digest.hexdigest()[:12]
