"""`zenocap sync`: the times at which the videos of a rig begin, from sound or silhouettes, and the file for them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import EndedEarly, UserError
from zenocap.common.messages import Silhouette
from zenocap.common.rig.folder import SYNC_FILE
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import VideoFile
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.viewer import silhouette_step
from zenocap.services.viewer.shell import silhouette_service
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.sync.pairs import Offset, offsets_of, reach_s
from zenocap.tools.sync.sound import SOUND_LIMITS, SoundPair, read_sound
from zenocap.tools.sync.tangents import SILHOUETTE_LIMITS, Outline, outline_of, silhouette_pairs

Method = Literal["auto", "sound", "silhouettes"]
SOUND, SILHOUETTES = "sound", "silhouettes"
NO_PERSON = "no person in view"
TOGETHER = "the videos began together within the errors of the offsets: 0 is taken"
TOGETHER_ERRORS, TOGETHER_FRAMES = 2.0, 0.5  # largest offsets of videos that began together; chosen by hand


@dataclass(frozen=True)
class Options:
    """max_offset_s: largest difference of two beginnings.  seconds: length of the part of each video to use."""

    by: Method = "auto"
    max_offset_s: float = 10.0
    seconds: float = 120.0


@dataclass(frozen=True)
class CameraOffset:
    """Offset of one camera.  source: what it was found from, "sound" or "silhouettes"."""

    source: str
    offset: Offset

    @property
    def is_certain(self) -> bool:
        return not self.offset.reason


def synchronize(
    rig: Rig, options: Options, on_frame: Callable[[int], None] = lambda _: None
) -> tuple[dict[str, CameraOffset], list[str]]:
    """Offset of each viewer's video from that of the first certain one, and notes for the user.

    on_frame: receives the number of frames segmented so far.  Raises UserError.
    """
    viewers = {viewer.id: _from_its_beginning(rig, viewer) for viewer in rig.viewers}
    found: dict[str, CameraOffset] = {}
    notes: list[str] = []
    if options.by != SILHOUETTES:
        sounds = {id: read_sound(viewer.source.path, options.seconds) for id, viewer in viewers.items()}  # type: ignore[union-attr]
        found, notes = _by_sound(sounds, options)
        if options.by == SOUND or all(id in found and found[id].is_certain for id in viewers):
            silent = Offset(float("nan"), float("nan"), 0.0, float("nan"), 0, "no sound")
            return _together(viewers, {id: found.get(id, CameraOffset(SOUND, silent)) for id in viewers}, notes), notes
    known = {id: one.offset.offset_s for id, one in found.items() if one.is_certain}
    outlines = outlines_of(viewers, options.seconds, on_frame)
    cameras = {id: viewer.camera for id, viewer in viewers.items()}
    pairs = silhouette_pairs(cameras, outlines, reach_s(options.max_offset_s))
    limits = replace(SILHOUETTE_LIMITS, max_lag_s=options.max_offset_s)
    for id, offset in offsets_of(list(viewers), pairs, limits, known).items():
        if id not in known:
            offset = replace(offset, reason=NO_PERSON) if len(outlines[id]) < 3 else offset
            found[id] = CameraOffset(SILHOUETTES, offset)
    return _together(viewers, found, notes), notes


def _by_sound(sounds: Mapping[str, Floats | None], options: Options) -> tuple[dict[str, CameraOffset], list[str]]:
    """Offsets of the cameras with sound, and notes."""
    tracks = {id: sound for id, sound in sounds.items() if sound is not None}
    notes = [f"{id}: no sound" for id in sounds if id not in tracks] if tracks else ["no video has sound"]
    if len(tracks) < 2:
        return {}, notes
    names = list(tracks)
    pairs = {
        (a, b): SoundPair(tracks[a], tracks[b], reach_s(options.max_offset_s))
        for k, a in enumerate(names)
        for b in names[k + 1 :]
    }
    found = offsets_of(names, pairs, replace(SOUND_LIMITS, max_lag_s=options.max_offset_s), {})
    if sum(not offset.reason for offset in found.values()) < 2:  # a group of one
        reason = "the sound of the videos has too little in common"
        found = {id: replace(offset, reason=offset.reason or reason) for id, offset in found.items()}
    return {id: CameraOffset(SOUND, offset) for id, offset in found.items()}, notes


def _from_its_beginning(rig: Rig, viewer: Viewer) -> Viewer:
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
            service, outlines = silhouette_service(viewer), found.setdefault(id, [])
            state: silhouette_step.State = service.state
            frames = open_source(viewer, Playback(0, ManualClock(0), live=False))
            while True:
                try:
                    frame = next(frames, None)
                except EndedEarly:
                    break  # a cut file: what was read of it counts
                if frame is None or frame.captured_ns > seconds * 1e9:
                    break
                state, messages = silhouette_step.step(service.setup, state, frame)
                for message in messages:
                    if isinstance(message, Silhouette) and message.data:
                        mask = unpack(message.size, message.region, message.data)
                        if (outline := outline_of(viewer.camera, mask, frame.captured_ns / 1e9)) is not None:
                            outlines.append(outline)
                count += 1
                on_frame(count)
    finally:
        cv2.setNumThreads(before)
    return found


def _from_first(names: Mapping[str, object], found: Mapping[str, CameraOffset]) -> dict[str, CameraOffset]:
    """The offsets in the rig's order, counted from the first camera that is certain."""
    first = next((found[id].offset.offset_s for id in names if found[id].is_certain), 0.0)
    return {
        id: replace(found[id], offset=replace(found[id].offset, offset_s=found[id].offset.offset_s - first)) for id in names
    }


def _together(
    viewers: Mapping[str, Viewer], found: Mapping[str, CameraOffset], notes: list[str]
) -> dict[str, CameraOffset]:
    """The offsets from the first camera on; all 0, with a note, where none differs from 0 by more than its error.

    Videos that do not belong together begin within half a frame period of each other only by rare chance.
    """
    offsets = _from_first(viewers, found)
    for id, one in offsets.items():
        largest_s = min(TOGETHER_ERRORS * one.offset.error_s, TOGETHER_FRAMES / viewers[id].fps)
        if not one.is_certain or abs(one.offset.offset_s) > largest_s:
            return offsets
    if any(one.offset.offset_s for one in offsets.values()):
        notes.append(TOGETHER)
    return {id: replace(one, offset=replace(one.offset, offset_s=0.0)) for id, one in offsets.items()}


def sync_text(offsets: Mapping[str, float], comment: str) -> str:
    """Content of `sync.toml`.  offsets: seconds, by camera."""
    lines = [f"# {comment}", "[offset_s]", *(f'"{name}" = {offset_s + 0.0:.4f}' for name, offset_s in offsets.items())]
    return "\n".join(lines) + "\n"


def write_sync(folder: Path, offsets: Mapping[str, float], comment: str) -> Path:
    """Write `sync.toml` of a folder.  Raises UserError."""
    path = folder / SYNC_FILE
    try:
        write_atomically(path, sync_text(offsets, comment).encode())
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from error
    return path
