"""A folder in the Pose2Sim layout as a rig: `calibration.toml`, `videos/`, and what may lie beside them.

videos/NAME.mp4        one per camera that takes part
background/NAME.png    a picture of the empty scene; else
clip.toml              empty_frames = the first frames of each video that are empty; up_axis; fps
stretched/NAME.mp4     the initial posture, where the main video does not show it
"""

import re
from pathlib import Path

from common.camera.files import CalibrationError, read_calibration
from common.runtime.rig_file import LogTable, RigError, RigFile, ViewerTable, ZenohTable, read_toml

VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v", ".mpg")
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp")


def folder_rig(folder: Path, method: str) -> tuple[RigFile, tuple[str, ...]]:
    """The folder's rig file, as if somebody had written it, and notes for the user.  Raises RigError."""
    calibration = folder / "calibration.toml"
    if not calibration.is_file():
        raise RigError(f"{folder}: calibration.toml is missing: allowed: a rig file or a folder with it and videos/")
    clip_path = folder / "clip.toml"
    clip = read_toml(clip_path) if clip_path.is_file() else {}
    up_axis, fps, empty = (_clip_value(clip_path, clip, *row) for row in CLIP_KEYS)
    try:
        cameras = list(read_calibration(calibration, str(up_axis)))
    except CalibrationError as error:
        raise RigError(str(error)) from error
    videos, notes = _videos(folder, cameras)
    viewers = []
    for name, video in videos.items():
        plate = _beside(folder / "background", name, video.stem, IMAGE_SUFFIXES)
        background = f"image:{plate}" if plate else f"first:{empty}" if empty else "median"
        if background == "median":
            notes.append(f"{name}: no background picture and no empty_frames: the median of its video is used")
        initial = _beside(folder / "stretched", name, video.stem, VIDEO_SUFFIXES)
        viewers.append(
            ViewerTable(
                id=plain_name(name),
                camera=name,
                source=str(video.relative_to(folder)),
                background=background,
                fps=None if fps is None else float(str(fps)),
                initial=initial,
            )
        )
    content = RigFile(
        name=plain_name(folder.resolve().name),
        calibration=calibration.name,
        viewer=tuple(viewers),
        up_axis=str(up_axis),
        method=method,
        zenoh=ZenohTable(),
        log=LogTable(),
    )
    return content, tuple(notes)


CLIP_KEYS: tuple[tuple[str, object, str], ...] = (
    ("up_axis", "y", "'y' or 'z'"),
    ("fps", None, "above 0 to 1000"),
    ("empty_frames", 0, "a whole number from 0 to 10000"),
)


def _clip_value(path: Path, clip: dict[str, object], key: str, default: object, allowed: str) -> object:
    value = clip.get(key, default)
    match key:
        case "up_axis":
            good = value in ("y", "z")
        case "fps":
            good = value is None or (isinstance(value, int | float) and 0 < value <= 1000)
        case _:
            good = isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 10_000
    if not good:
        raise RigError(f"{path}: {key} = {value!r}: allowed: {allowed}")
    return value


def plain_name(text: str) -> str:
    """`text` as keys and messages allow it."""
    return re.sub(r"[^A-Za-z0-9_.\-]", "-", text)[:64] or "rig"


def _videos(folder: Path, cameras: list[str]) -> tuple[dict[str, Path], list[str]]:
    """Camera to video, by name; where no name fits, by order, as Pose2Sim does."""
    found = sorted(p for p in (folder / "videos").glob("*") if p.suffix.lower() in VIDEO_SUFFIXES)
    if not found:
        raise RigError(f"{folder}: videos/ has no video: allowed: NAME{' NAME'.join(VIDEO_SUFFIXES)}, NAME of a camera")
    by_stem: dict[str, Path] = {}
    for path in found:
        if path.stem in by_stem:
            raise RigError(f"{path}: {by_stem[path.stem].name} is there too: allowed: one video per camera")
        by_stem[path.stem] = path
    paired = {name: by_stem[name] for name in cameras if name in by_stem}
    if not paired and len(found) == len(cameras):
        pairs = dict(zip(cameras, found, strict=True))
        words = ", ".join(f"{name} = {path.name}" for name, path in pairs.items())
        return pairs, [f"no video has a camera's name: taken in order: {words}"]
    if strangers := [path.name for path in found if path.stem not in paired]:
        raise RigError(
            f"{folder}: videos/{strangers[0]} belongs to no camera of calibration.toml; there are: {', '.join(cameras)}"
        )
    notes = [f"{name}: no video: it takes no part" for name in cameras if name not in paired]
    return paired, notes


def _beside(folder: Path, name: str, stem: str, suffixes: tuple[str, ...]) -> str | None:
    """`folder`'s name and the file of this camera in it; None when there is none."""
    for candidate in (name, stem):
        for suffix in suffixes:
            if (folder / f"{candidate}{suffix}").is_file():
                return f"{folder.name}/{candidate}{suffix}"
    return None
