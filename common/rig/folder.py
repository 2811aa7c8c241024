"""A folder in the Pose2Sim layout as a rig: `calibration.toml`, `videos/`, and optional files.

videos/NAME.mp4        one per camera that takes part
background/NAME.png    a picture of the empty scene; else
clip.toml              empty_seconds, or empty_frames = the beginning of each video that is empty; up_axis; fps
stretched/NAME.mp4     the T-pose, where the main video does not show it
corners/NAME.corners   corners of a board in the camera's video, as `zenocap calibrate detect` writes them
sync.toml              [offset_s] NAME = time in seconds at which the camera's video begins, as `zenocap sync` writes it
"""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path

from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import UserError, reading
from zenocap.common.rig.file import MAX_OFFSET_S, RigFile, ViewerTable
from zenocap.common.rig.sources import BARE_SUFFIXES, MAX_FIRST, MAX_FIRST_S, VIDEO_SUFFIXES, SpecError, first_text
from zenocap.common.toml_file import read_toml

SYNC_FILE = "sync.toml"
CORNERS, CORNERS_SUFFIX = "corners", ".corners"
MEDIAN = "median"  # background
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp")
MISSPELT = 0.8  # likeness of a key of clip.toml to a known one; by hand: above those of others, as stretched_frames


def folder_rig(
    folder: Path, method: str, cameras: Sequence[str] | None = None, calibration: Path | None = None,
    background: str | None = None,
) -> tuple[RigFile, tuple[str, ...]]:  # fmt: skip
    """Rig file content equivalent to the folder, and notes for the user.  cameras: see `chosen`.

    calibration, background: to use instead of the folder's own.  Raises UserError.
    """
    own = calibration is None
    calibration = folder / "calibration.toml" if calibration is None else calibration
    if not calibration.is_file():
        raise UserError(f"{folder}: calibration.toml is missing: allowed: a rig file or a folder with it and videos/")
    clip_path = folder / "clip.toml"
    clip = read_toml(clip_path) if clip_path.is_file() else {}
    up_axis, fps, frames, seconds = (_clip_value(clip_path, clip, *row) for row in CLIP_KEYS)
    try:
        empty = first_text(int(str(frames)), float(str(seconds)))
    except SpecError as error:
        raise UserError(f"{clip_path}: {error}") from error
    calibrated = list(read_calibration(calibration, str(up_axis)))
    videos, notes = _videos(folder, calibration, calibrated)
    near = ((key, get_close_matches(key, [known for known, *_ in CLIP_KEYS], 1, MISSPELT)) for key in clip)
    notes += [f"clip.toml: {key!r} is not used: did you mean {one[0]}?" for key, one in near if one and key not in one]
    offsets = read_offsets(folder / SYNC_FILE, calibrated)
    if offsets:
        notes.append(f"{SYNC_FILE}: videos begin at {', '.join(f'{name} {time:+.3f} s' for name, time in offsets.items())}")
    viewers = []
    for name, video in videos.items():
        plate = _camera_file(folder / "background", name, video.stem, IMAGE_SUFFIXES)
        viewers.append(
            ViewerTable(
                id=plain_name(name),
                camera=name,
                source=str(video.relative_to(folder)),
                background=background or (f"image:{plate}" if plate else empty or MEDIAN),
                fps=None if fps is None else float(str(fps)),
                initial=_camera_file(folder / "stretched", name, video.stem, VIDEO_SUFFIXES),
                offset_s=offsets.get(name, 0.0),
            )
        )
    viewers = chosen(folder, viewers, cameras)
    calibration_name = calibration.name if own else str(calibration.resolve())
    content = _rig_file(folder.resolve().name, calibration_name, viewers, str(up_axis), method)
    return content, (*notes, *_median_notes(viewers))


def rig_of_files(
    videos: Sequence[Path], calibration: Path, up_axis: str, background: str, method: str,
    cameras: Sequence[str] | None = None,
) -> tuple[RigFile, tuple[str, ...]]:  # fmt: skip
    """Rig file content of videos and a calibration in any folder, and notes; cameras: see `chosen`.  Raises UserError."""
    for file in (*videos, calibration):
        if not file.is_file():
            raise UserError(f"{file}: no such file")
    if up_axis not in ("y", "z"):
        raise UserError(f"up axis {up_axis!r}: allowed: y or z")
    paired, notes = _paired(calibration, list(read_calibration(calibration, up_axis)), videos)
    viewers = [
        ViewerTable(id=plain_name(name), camera=name, source=str(video.resolve()), background=background)
        for name, video in paired.items()
    ]
    viewers = chosen(calibration, viewers, cameras)
    folder = videos[0].resolve().parent
    name = (folder.parent if folder.name == "videos" else folder).name
    content = _rig_file(name, str(calibration.resolve()), viewers, up_axis, method)
    return content, (*notes, *_median_notes(viewers))


def chosen(path: Path, viewers: Sequence[ViewerTable], cameras: Sequence[str] | None) -> list[ViewerTable]:
    """The viewers of these cameras, or of these ids, in the order of the rig; all without `cameras`.

    path: of the rig, for errors.  Raises UserError, which lists the existing names.
    """
    if cameras is None:
        return list(viewers)
    names = [one.camera if one.camera == one.id else f"{one.id} ({one.camera})" for one in viewers]
    for name in cameras:
        if not any(name in (one.id, one.camera) for one in viewers):
            raise UserError(f"{path}: cameras: {name!r}: no such camera: allowed: {', '.join(names)}")
    found = [one for one in viewers if one.id in cameras or one.camera in cameras]
    if len(found) < 2:
        given = ", ".join(cameras) or "none"
        raise UserError(f"{path}: cameras: {given}: {len(found)} camera(s): allowed: two or more of {', '.join(names)}")
    return found


def _rig_file(name: str, calibration: str, viewers: Sequence[ViewerTable], up_axis: str, method: str) -> RigFile:
    return RigFile(name=plain_name(name), calibration=calibration, viewer=tuple(viewers), up_axis=up_axis, method=method)


def _median_notes(viewers: Sequence[ViewerTable]) -> list[str]:
    cameras = ", ".join(viewer.camera for viewer in viewers if viewer.background == MEDIAN)
    if not cameras:
        return []
    return [
        f"{cameras}: no background picture and no empty_seconds: the median of the video is used; without an empty part, a "
        "person who stays in one place for half of it becomes part of the room, with holes in the silhouettes"
    ]


def read_offsets(path: Path, cameras: Sequence[str]) -> dict[str, float]:
    """Time in seconds at which each camera's video begins; empty without the file.  Raises UserError."""
    if not path.is_file():
        return {}
    content = read_toml(path)
    offsets = content.get("offset_s")
    if not isinstance(offsets, dict) or len(content) != 1:
        raise UserError(f"{path}: allowed: one table [offset_s] with a number for each camera")
    for name, value in offsets.items():
        if name not in cameras:
            raise UserError(f"{path}: offset_s.{name}: no such camera: allowed: {', '.join(cameras)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MAX_OFFSET_S:
            raise UserError(
                f"{path}: offset_s.{name} = {value!r}: allowed: seconds from {-MAX_OFFSET_S:g} to {MAX_OFFSET_S:g}"
            )
    return {name: float(value) for name, value in offsets.items()}


CLIP_KEYS: tuple[tuple[str, object, str], ...] = (
    ("up_axis", "y", "'y' or 'z'"),
    ("fps", None, "above 0 to 1000"),
    ("empty_frames", 0, f"a whole number from 0 to {MAX_FIRST}"),
    ("empty_seconds", 0.0, f"seconds from 0 to {MAX_FIRST_S:g}"),
)


def _clip_value(path: Path, clip: dict[str, object], key: str, default: object, allowed: str) -> object:
    value = clip.get(key, default)
    match key:
        case "up_axis":
            good = value in ("y", "z")
        case "fps":
            good = value is None or (isinstance(value, int | float) and 0 < value <= 1000)
        case "empty_seconds":
            good = isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= MAX_FIRST_S
        case _:
            good = isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_FIRST
    if not good:
        raise UserError(f"{path}: {key} = {value!r}: allowed: {allowed}")
    return value


def plain_name(text: str) -> str:
    """`text` without characters that are not allowed in keys and messages."""
    return re.sub(r"[^A-Za-z0-9_.\-]", "-", text)[:64] or "rig"


def with_suffix(folder: Path, suffixes: Sequence[str]) -> list[Path]:
    """Files, by name; none without the folder, hidden ones such as macOS's ._NAME, bare streams beside the same container.

    Raises UserError for a folder that cannot be read.
    """
    if not folder.is_dir():
        return []
    with reading(folder):
        found = [path for path in folder.iterdir() if path.suffix.lower() in suffixes and not path.name.startswith(".")]
    whole = {_composed(path.stem) for path in found if path.suffix.lower() not in BARE_SUFFIXES}
    found = [path for path in found if path.suffix.lower() not in BARE_SUFFIXES or _composed(path.stem) not in whole]
    return sorted(path for path in found if path.is_file())


def _videos(folder: Path, calibration: Path, cameras: list[str]) -> tuple[dict[str, Path], list[str]]:
    """Video by camera: matched by name, or by order when no name matches, as in Pose2Sim."""
    found = with_suffix(folder / "videos", VIDEO_SUFFIXES)
    if not found:
        raise UserError(f"{folder}: videos/ has no video: allowed: NAME{' NAME'.join(VIDEO_SUFFIXES)}, NAME of a camera")
    paired, notes = _paired(calibration, cameras, found)
    others = [path for path in sorted((folder / "videos").glob("[!.]*")) if path not in paired.values() and path.is_file()]
    without = [name for name in cameras if name not in paired]
    unused = [path.name for name in without for path in others if _contains(path.stem, name)]
    notes += [f"videos/{name}: not used, by its suffix: allowed: {' '.join(VIDEO_SUFFIXES)}" for name in unused]
    if without and len(paired) < 2:
        missing = f"videos/ has no video of {', '.join(without)}: allowed: those of two cameras or more"
        raise UserError(f"{folder}: {notes[-1] if unused else missing}")
    notes += [f"videos/{one.name}: not used: a spare bare stream" for one in others if one.suffix.lower() in BARE_SUFFIXES]
    return paired, notes


def _paired(calibration: Path, cameras: Sequence[str], videos: Sequence[Path]) -> tuple[dict[str, Path], list[str]]:
    """Video by camera, and notes.  Raises UserError."""
    by_stem: dict[str, Path] = {}
    for path in videos:
        if (stem := _composed(path.stem)) in by_stem:
            raise UserError(f"{path}: {by_stem[stem]} exists too: allowed: one video per camera")
        by_stem[stem] = path
    paired = {name: by_stem[_composed(name)] for name in cameras if _composed(name) in by_stem}
    contained = _by_contained_names(cameras, [path for path in videos if path not in paired.values()], paired)
    found, notes = paired | contained, []
    rest = [path for path in videos if path not in found.values() and not (found and path.suffix.lower() in BARE_SUFFIXES)]
    if contained:
        pairing = ", ".join(f"{name} = {contained[name].name}" for name in cameras if name in contained)
        notes.append(f"assigned by the names within: {pairing}")
    without = [name for name in cameras if name not in found]
    if rest == sorted(rest):  # as a shell lists them, where 10 is before 9; other orders were chosen
        rest, without = sorted(rest, key=lambda path: _natural(path.name)), _in_order(without)
    pairs = dict(zip(without, rest, strict=False))
    crossed = found and any(re.search(r"\d", name) and re.search(r"\d", path.stem) for name, path in pairs.items())
    if rest and len(videos) == len(cameras) and not paired and not crossed:
        pairing = ", ".join(f"{name} = {path.name}" for name, path in pairs.items())
        notes.append(f"{'the others' if contained else 'no video is named after a camera'}: assigned in order: {pairing}")
        found |= pairs
    elif rest:
        raise UserError(f"{rest[0]}: belongs to no camera of {calibration}; there are: {', '.join(cameras)}")
    notes += [f"{name}: no video: this camera is not used" for name in cameras if name not in found]
    return {name: found[name] for name in cameras if name in found}, notes


def _by_contained_names(cameras: Sequence[str], videos: Sequence[Path], known: Mapping[str, Path]) -> dict[str, Path]:
    """Video by camera, where the name of one contains that of exactly one other.  known: cameras that have a video.

    Raises UserError for two videos of one camera, unless its name is a number, which may be that of a trial.
    """
    found: dict[str, Path] = {}
    while True:
        free = [name for name in cameras if name not in known and name not in found]
        fits = {
            path: [name for name in free if _numbered_camera(path.stem, name)]
            or [name for name in free if _contains(path.stem, name) or _contains(name, path.stem)]
            or [name for name in free if _contains(_short(path.stem), _short(name))]
            for path in videos
            if path not in found.values()
        }
        certain = {path: names[0] for path, names in fits.items() if len(names) == 1}
        if not certain:
            return found
        for path, name in certain.items():
            if name not in found:
                found[name] = path
            elif name.isdigit():
                return {}
            else:
                raise UserError(f"{path}: {found[name].name} is of camera {name} too: allowed: one video per camera")


def _contains(text: str, name: str) -> bool:
    """Whether a text has a name in it that is not part of a longer word or number: cam1 is not in cam10."""
    text, name = _composed(text), _composed(name)
    before = r"(?<!\d)" if name[:1].isdigit() else r"(?<![^\W\d_])"
    after = r"(?!\d)" if name[-1:].isdigit() else r"(?![^\W\d_])"
    return bool(name) and re.search(f"{before}{re.escape(name)}{after}", text, re.IGNORECASE) is not None


def _numbered_camera(text: str, name: str) -> bool:
    """Whether a name is a number, and a text has it behind the word cam or camera: other numbers are of trials."""
    if not name.isdecimal():
        return False
    return re.search(rf"(?<![^\W\d_])cam(?:era)?[ _-]*0*{int(name)}(?!\d)", text, re.IGNORECASE) is not None


def _short(name: str) -> str:
    """A name whose numbers have no leading zeros."""
    return re.sub(r"(?<!\d)0+(?=\d)", "", name)


def _composed(name: str) -> str:
    """A name whose letters with accents are one character each: macOS writes names of files with two."""
    return unicodedata.normalize("NFC", name)


def _natural(name: str) -> list[tuple[int, str]]:
    """Sorting key in which numbers count by their value."""
    return [(int(part), "") if part.isdecimal() else (-1, part.lower()) for part in re.split(r"(\d+)", name) if part]


def _in_order(cameras: list[str]) -> list[str]:
    """Names that differ in their numbers alone in the order of those; others in that of the calibration."""
    return sorted(cameras, key=_natural) if len({re.sub(r"\d+", "", name) for name in cameras}) == 1 else cameras


def _camera_file(folder: Path, name: str, stem: str, suffixes: tuple[str, ...]) -> str | None:
    """Relative path, `folder` and file name, of this camera's file; None when there is none.

    Capitals do not count, as on some disks; of files that differ in them alone, the one with those of the camera is taken.
    """
    files = with_suffix(folder, suffixes)
    for candidate in (name, stem):
        if same := [path for path in files if _composed(path.stem).lower() == _composed(candidate).lower()]:
            found = min(same, key=lambda path: (path.stem != candidate, suffixes.index(path.suffix.lower())))
            return f"{folder.name}/{found.name}"
    return None
