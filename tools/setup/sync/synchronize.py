"""`zenocap sync`: beginnings of a rig's videos, and the file for them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from math import hypot, inf, nan
from pathlib import Path
from typing import Literal

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.lags.delays import limits_of
from zenocap.common.lags.pairs import Comparison, Limits, VideoOffset, offsets_of, reach_s
from zenocap.common.lags.tangents import Outline, silhouette_pairs
from zenocap.common.rig.folder import SYNC_FILE
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.tools.setup.sync.light import FLASH_LIMITS, FlashPair, light_changes
from zenocap.tools.setup.sync.sound import SOUND_LIMITS, SoundPair, read_sound
from zenocap.tools.setup.sync.videos import brightness_in, from_its_beginning, outlines_of

Method = Literal["auto", "sound", "flash", "silhouettes"]
SOUND, FLASH, SILHOUETTES = "sound", "flash", "silhouettes"
UNKNOWN = VideoOffset(nan, nan, 0.0, nan, 0, "unknown")
NO_PERSON = "no person in view"
TOGETHER = "the videos began together within the errors of the offsets: 0 is taken"
EXACT_FRAMES = 0.1  # standard error of flashes, up to which silhouettes are not compared too
CONTRADICTION_ERRORS = 5.0
CONTRADICTION = "flash and silhouettes contradict each other: choose with --by"
TOGETHER_ERRORS, TOGETHER_FRAMES = 2.0, 0.5  # largest offsets of videos that began together; chosen by hand


@dataclass(frozen=True)
class SyncOptions:
    """max_offset_s: largest difference of two beginnings.  seconds: length of the part of each video to use."""

    by: Method = "auto"
    max_offset_s: float = 10.0
    seconds: float = 120.0


@dataclass(frozen=True)
class CameraOffset:
    """Offset of one camera.  source: what it was found from, "sound", "flash" or "silhouettes"."""

    source: str
    offset: VideoOffset

    @property
    def is_certain(self) -> bool:
        return not self.offset.reason


def synchronize(
    rig: Rig, options: SyncOptions, on_frame: Callable[[int], None] = lambda _: None
) -> tuple[dict[str, CameraOffset], list[str]]:
    """Offset of each viewer's video from that of the first certain one, and notes for the user.

    on_frame: receives the number of frames segmented so far.  Raises UserError.
    """
    viewers = {viewer.id: from_its_beginning(rig, viewer) for viewer in rig.viewers}
    found: dict[str, CameraOffset] = {}
    notes: list[str] = []
    if options.by in ("auto", SOUND):
        sounds = {id: read_sound(viewer.source.path, options.seconds) for id, viewer in viewers.items()}  # type: ignore[attr-defined]
        found, notes = _by_sound(sounds, options)
        if options.by == SOUND or _all_certain(viewers, found):
            silent = CameraOffset(SOUND, replace(UNKNOWN, reason="no sound"))
            return _together(viewers, {id: found.get(id, silent) for id in viewers}, notes), notes
    known = {id: one for id, one in found.items() if one.is_certain}
    flashes: dict[str, CameraOffset] = {}
    if options.by in ("auto", FLASH):
        flashes = _by_flash(viewers, options, known)
        exact = all(one.offset.error_s <= EXACT_FRAMES / viewers[id].fps for id, one in flashes.items())
        if options.by == FLASH or (exact and _all_certain(viewers, flashes)):
            return _together(viewers, flashes, notes), notes
    outlines = outlines_of(viewers, options.seconds, on_frame)
    silhouettes = _by_silhouettes(viewers, outlines, options, known)
    if _all_certain(viewers, silhouettes) and _all_certain(viewers, flashes):
        for id in viewers:
            one, other = silhouettes[id].offset, flashes[id].offset
            apart_s = abs(one.offset_s - other.offset_s)
            if apart_s > CONTRADICTION_ERRORS * hypot(one.error_s, other.error_s):
                silhouettes[id] = replace(silhouettes[id], offset=replace(one, reason=CONTRADICTION))
                flashes[id] = replace(flashes[id], offset=replace(other, reason=CONTRADICTION))
        if not _all_certain(viewers, silhouettes):
            return _together(viewers, silhouettes, notes), notes
    if _all_certain(viewers, silhouettes) and _error_s(silhouettes) <= _error_s(flashes):
        return _together(viewers, silhouettes, notes), notes
    if any(one.is_certain for id, one in flashes.items() if id not in known):
        known |= {id: one for id, one in flashes.items() if one.is_certain}
        silhouettes = _by_silhouettes(viewers, outlines, options, known)
    return _together(viewers, silhouettes, notes), notes


def _all_certain(viewers: Mapping[str, Viewer], found: Mapping[str, CameraOffset]) -> bool:
    return all(id in found and found[id].is_certain for id in viewers)


def _error_s(found: Mapping[str, CameraOffset]) -> float:
    """Largest standard error of certain offsets; infinite where one is not certain, or without any."""
    return max((one.offset.error_s if one.is_certain else inf for one in found.values()), default=inf)


def _by_flash(
    viewers: Mapping[str, Viewer], options: SyncOptions, known: Mapping[str, CameraOffset]
) -> dict[str, CameraOffset]:
    """Offsets of all cameras from changes of the light; those of `known` ones stay."""
    changes = {
        id: light_changes(brightness_in(viewer.source.path, options.seconds))  # type: ignore[attr-defined]
        for id, viewer in viewers.items()
    }
    seen = [id for id in viewers if changes[id]]
    pairs = {(a, b): FlashPair(changes[a], changes[b], reach_s(options.max_offset_s)) for a, b in combinations(seen, 2)}
    found = _compared(viewers, pairs, replace(FLASH_LIMITS, max_lag_s=options.max_offset_s), known, FLASH)
    dark = CameraOffset(FLASH, replace(UNKNOWN, reason="no flash"))
    return {id: one if id in seen or id in known else dark for id, one in found.items()}


def _by_silhouettes(
    viewers: Mapping[str, Viewer],
    outlines: Mapping[str, list[Outline]],
    options: SyncOptions,
    known: Mapping[str, CameraOffset],
) -> dict[str, CameraOffset]:
    """Offsets of all cameras from silhouettes; those of `known` ones stay."""
    cameras = {id: viewer.camera for id, viewer in viewers.items()}
    pairs = silhouette_pairs(cameras, outlines, reach_s(options.max_offset_s))
    found = _compared(viewers, pairs, limits_of(options.max_offset_s), known, SILHOUETTES)
    return {
        id: one
        if id in known or len(outlines[id]) > 2
        else CameraOffset(SILHOUETTES, replace(one.offset, reason=NO_PERSON))
        for id, one in found.items()
    }


def _compared(
    viewers: Mapping[str, Viewer],
    pairs: Mapping[tuple[str, str], Comparison],
    limits: Limits,
    known: Mapping[str, CameraOffset],
    source: str,
) -> dict[str, CameraOffset]:
    """Offsets of all cameras by `source`; those of `known` ones stay."""
    offsets = offsets_of(list(viewers), pairs, limits, {id: one.offset.offset_s for id, one in known.items()})
    return {id: known[id] if id in known else CameraOffset(source, offset) for id, offset in offsets.items()}


def _by_sound(sounds: Mapping[str, Floats | None], options: SyncOptions) -> tuple[dict[str, CameraOffset], list[str]]:
    """Offsets of the cameras with sound, and notes."""
    tracks = {id: sound for id, sound in sounds.items() if sound is not None}
    notes = [f"{id}: no sound" for id in sounds if id not in tracks] if tracks else ["no video has sound"]
    if len(tracks) < 2:
        return {}, notes
    pairs = {(a, b): SoundPair(tracks[a], tracks[b], reach_s(options.max_offset_s)) for a, b in combinations(tracks, 2)}
    found = offsets_of(list(tracks), pairs, replace(SOUND_LIMITS, max_lag_s=options.max_offset_s), {})
    if sum(not offset.reason for offset in found.values()) < 2:  # a group of one
        reason = "the sound of the videos has too little in common"
        found = {id: replace(offset, reason=offset.reason or reason) for id, offset in found.items()}
    return {id: CameraOffset(SOUND, offset) for id, offset in found.items()}, notes


def _together(
    viewers: Mapping[str, Viewer], found: Mapping[str, CameraOffset], notes: list[str]
) -> dict[str, CameraOffset]:
    """The offsets in the rig's order, from the first certain one on; all 0, with a note, where none is above its error.

    Videos that do not belong together begin within half a frame period of each other only by rare chance.
    """
    first_s = next((found[id].offset.offset_s for id in viewers if found[id].is_certain), 0.0)
    offsets = {id: _at(found[id], found[id].offset.offset_s - first_s) for id in viewers}
    for id, one in offsets.items():
        largest_s = min(TOGETHER_ERRORS * one.offset.error_s, TOGETHER_FRAMES / viewers[id].fps)
        if not one.is_certain or abs(one.offset.offset_s) > largest_s:
            return offsets
    if any(one.offset.offset_s for one in offsets.values()):
        notes.append(TOGETHER)
    return {id: _at(one, 0.0) for id, one in offsets.items()}


def _at(one: CameraOffset, offset_s: float) -> CameraOffset:
    return replace(one, offset=replace(one.offset, offset_s=offset_s))


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
