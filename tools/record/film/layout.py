"""The folder of a film: what `zenocap track` takes."""

from collections.abc import Sequence
from pathlib import Path

from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX, with_suffix
from zenocap.common.rig.rig import Viewer
from zenocap.common.rig.sources import BARE_SUFFIXES, VIDEO_SUFFIXES, FirstFrames
from zenocap.tools.record.film.camera import Filmed
from zenocap.tools.setup.sync.synchronize import write_sync

CALIBRATION, CLIP, SYNC = "calibration.toml", "clip.toml", "sync.toml"


def prepare(folder: Path, viewers: Sequence[Viewer], force: bool, *, calibrated: bool = True) -> None:
    """Make the folder and remove what would be replaced.  Raises UserError when that is there, without `force`.

    calibrated: whether a calibration is written; otherwise one that is there is kept.
    """
    written = (CALIBRATION, CLIP, SYNC) if calibrated else (CLIP, SYNC)
    videos = [path for path in with_suffix(folder / "videos", VIDEO_SUFFIXES) if path.suffix.lower() not in BARE_SUFFIXES]
    own = {viewer.camera.name for viewer in viewers}
    replaced = sorted([*(folder / CORNERS).glob(f"*{CORNERS_SUFFIX}"), *(folder / "times").glob("*.csv")])
    existing = [*videos, *(path for name in written if (path := folder / name).exists()), *replaced]
    if existing and not force:
        raise UserError(f"{existing[0]} exists: allowed: another folder, or --force to replace it")
    if others := [path for path in videos if path.stem not in own]:
        raise UserError(f"{others[0]}: of a camera that is not filmed: allowed: a folder without it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in existing:
            path.unlink()
    except OSError as error:
        raise UserError(f"{folder}: {error.strerror}: allowed: a folder that can be written") from error


def write_layout(
    folder: Path, viewers: Sequence[Viewer], filmed: Sequence[Filmed], *, calibrated: bool = True, begins_empty: bool = True
) -> None:
    """Write calibration, beginnings of the videos, and the time of the empty scene where all viewers have one.

    calibrated: whether the viewers' cameras are; otherwise no calibration is written.  begins_empty: whether the time of
    the empty scene is written: a film of a rig that was tracking begins with a person in it.  Raises UserError, OSError.
    """
    if calibrated:
        cameras = {viewer.camera.name: viewer.camera.resized(viewer.calibrated_size) for viewer in viewers}
        write_calibration(folder / CALIBRATION, cameras)
    first_ns = min(one.first_ns for one in filmed if one.frames)
    offsets = {one.name: (one.first_ns - first_ns) / 1e9 for one in filmed if one.frames}
    comment = "\n# ".join(("Written by zenocap film, from capture times", *late_texts(viewers, filmed)))
    write_sync(folder, offsets, comment)
    empty = [one.background.count / one.fps for one in viewers if isinstance(one.background, FirstFrames)]
    if begins_empty and len(empty) == len(viewers):
        write_atomically(folder / CLIP, f"empty_seconds = {min(empty):.6g}\n".encode())


def late_texts(viewers: Sequence[Viewer], filmed: Sequence[Filmed]) -> list[str]:
    """Warnings of cameras whose first image came long after the start of the film."""
    rates = {viewer.camera.name: viewer.fps for viewer in viewers}
    return [text for one in filmed if (text := one.late_text(rates[one.name]))]
