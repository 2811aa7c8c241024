"""Videos of a film on other machines, and the commands that copy them."""

from collections.abc import Mapping
from pathlib import Path
from shlex import quote

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX, with_suffix
from zenocap.common.rig.sources import VIDEO_SUFFIXES
from zenocap.common.toml_file import quoted, read_toml

AWAY = "away.toml"
Places = Mapping[str, tuple[str, str]]  # machine and folder there, by camera


def write_away(folder: Path, places: Places) -> None:
    """Write where the videos that are not in the folder are; without any, remove the file of an earlier film."""
    if not places:
        (folder / AWAY).unlink(missing_ok=True)
        return
    lines = "".join(f"{quoted(name)} = [{quoted(host)}, {quoted(there)}]\n" for name, (host, there) in places.items())
    text = f"# Written by zenocap film: machine and folder of the videos that are not copied yet\n[away]\n{lines}"
    write_atomically(folder / AWAY, text.encode())


def copy_commands(folder: Path, places: Places) -> list[str]:
    """Commands that copy the videos and times of these cameras into the folder."""
    return [
        f"scp -- {quote(f'{host}:{there}/{part}/{name}.{suffix}')} {quote(str(folder / part))}/"
        for name, (host, there) in places.items()
        for part, suffix in (("videos", "mkv"), ("times", "csv"))
    ]


def detect_commands(folder: Path, places: Places, options: str = "--square MM") -> list[str]:
    """Commands that detect a board on the machines of these videos, and copy the corners into the folder.

    options: that describe the board.
    """
    detect = [
        f"ssh -- {quote(host)} {quote(f'zenocap calibrate detect {quote(there)} {options}')}"
        for host, there in dict.fromkeys(places.values())
    ]
    copy = [
        f"scp -- {quote(f'{host}:{there}/{CORNERS}/{name}{CORNERS_SUFFIX}')} {quote(str(folder / CORNERS))}/"
        for name, (host, there) in places.items()
    ]
    return [_make(folder, CORNERS), *detect, *copy]


def require_copied(folder: Path, *, corners: bool = False) -> None:
    """Raises UserError with `away_text` while there is one."""
    if text := away_text(folder, corners=corners):
        raise UserError(text)


def away_text(folder: Path, *, corners: bool = False) -> str:
    """Which videos of a film are still on other machines, with the commands that copy them; empty without any.

    corners: whether the corners of a board, detected in a video, do in its place.  Raises UserError.
    """
    path = folder / AWAY
    if not path.is_file():
        return ""
    table = read_toml(path).get("away")
    places: dict[str, tuple[str, str]] = {}
    for name, value in table.items() if isinstance(table, dict) else ():
        match value:
            case [str() as host, str() as there]:
                places[name] = (host, there)
            case _:
                raise UserError(f"{path}: away.{name} = {value!r}: allowed: [machine, folder]")
    copied = [one.stem for one in with_suffix(folder / "videos", VIDEO_SUFFIXES)]
    present = {name for name in copied if (folder / "times" / f"{name}.csv").exists()}  # which is copied after the video
    if corners:
        present |= {one.stem for place in (folder / CORNERS, folder) for one in place.glob(f"*{CORNERS_SUFFIX}")}
    missing = {name: place for name, place in places.items() if name not in present}
    if not missing:
        return ""
    places_text = ", ".join(f"{name} on {host}" for name, (host, _) in missing.items())
    copy = "\n  ".join([_make(folder, "videos", "times"), *copy_commands(folder, missing)])
    allowed = f"all videos in the folder; copy them (film --fetch does it in a rig with certificates):\n  {copy}"
    if corners:
        detect = "\n  ".join(detect_commands(folder, missing))
        allowed = f"{allowed}\nor the corners of the board, detected there, in place of videos:\n  {detect}"
    return f"{folder}: videos still on the machines of their cameras: {places_text}: allowed: {allowed}"


def _make(folder: Path, *parts: str) -> str:
    return "mkdir -p " + " ".join(quote(str(folder / part)) for part in parts)
