"""Bring the videos of other programs into the folder of the film: moved on this machine, copied over the network else."""

import hashlib
import os
import shutil
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from zenocap.common.errors import UserError
from zenocap.common.messages import FilmFile, FilmReply
from zenocap.common.runtime.foreign_text import printable
from zenocap.tools.film.parameters import CHECKSUM_S, FETCH_TRIES, POLL_S, QUERY_S
from zenocap.tools.film.remote import RemoteCamera, Unanswered
from zenocap.tools.film.remote_film import RemoteFilm

FILES = {"video": "videos/{name}.mkv", "times": "times/{name}.csv"}


def check_fetch(remote: RemoteFilm) -> None:
    """Raises UserError when a film could not be copied afterwards."""
    for camera in remote.cameras:
        if not camera.reply.may_read and camera.reply.host != socket.gethostname():
            raise UserError(
                f"{camera.name} on {camera.host}: pictures do not leave that machine: allowed with --fetch: a rig with "
                "certificates, or `zenocap viewer --allow-fetch` there"
            )


def collected(
    remote: RemoteFilm, folder: Path, *, fetch: bool, report: Callable[[str], None]
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Bring the videos of other programs into `folder`: those on this machine, and with `fetch` all.

    Returns notes by camera, and failures.
    """
    notes: dict[str, tuple[str, ...]] = {}
    failures: list[str] = []
    for camera in remote.cameras:
        notes[camera.name] = ()
        if not camera.reply.frames:
            continue
        place = f"{camera.host}:{printable(camera.reply.folder)}"
        try:
            if is_here(camera):
                move(camera, folder)
            elif fetch:
                size, seconds = copy(camera, folder, report)
                notes[camera.name] = (
                    f"{size / 1e6:.1f} MB copied from {place} at {size / 1e6 / max(seconds, 1e-3):.0f} MB/s",
                )
            else:
                notes[camera.name] = (f"on {place}",)
        except (UserError, OSError) as error:
            notes[camera.name] = (f"on {place}",)
            failures.append(f"{camera.name}: not copied: {error}")
    return notes, failures


def is_here(camera: RemoteCamera) -> bool:
    """Whether the files are on this machine and may be moved."""
    if camera.reply.host != socket.gethostname() or Path(camera.reply.folder).name != camera.film:
        return False
    video = Path(camera.reply.folder) / FILES["video"].format(name=camera.name)
    try:
        return video.stat().st_size >= camera.reply.written_bytes and os.access(video.parent, os.W_OK)
    except OSError:
        return False


def move(camera: RemoteCamera, folder: Path) -> None:
    """Move the files into `folder`.  Raises OSError."""
    origin = Path(camera.reply.folder)
    for template in FILES.values():
        name = template.format(name=camera.name)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.move(origin / name, folder / name)
    for place in (origin / "videos", origin / "times", origin):
        if place.is_dir() and not any(place.iterdir()):
            place.rmdir()


def copy(camera: RemoteCamera, folder: Path, report: Callable[[str], None]) -> tuple[int, float]:
    """Copy the files into `folder`, each whole or not at all; returns bytes and seconds.  Raises UserError."""
    begin_s, total = time.monotonic(), 0
    sizes = _checksums(camera)
    for kind, file in sizes.items():
        total += _copy(camera, kind, file, folder / FILES[kind].format(name=camera.name), report)
    return total, time.monotonic() - begin_s


def _checksums(camera: RemoteCamera) -> dict[str, FilmFile]:
    """Sizes and checksums, once they are all known."""
    end_s = time.monotonic() + CHECKSUM_S
    while True:
        files = _asked(camera, "files").files
        if set(files) != set(FILES):
            raise UserError(f"{camera.name} on {camera.host}: its files are gone")
        if all(file.sha256 for file in files.values()):
            return {str(kind): file for kind, file in files.items()}
        if time.monotonic() > end_s:
            raise UserError(f"{camera.name} on {camera.host}: no checksum within {CHECKSUM_S:.0f} s")
        time.sleep(POLL_S / 5)


def _copy(camera: RemoteCamera, kind: str, file: FilmFile, path: Path, report: Callable[[str], None]) -> int:
    """Copy one file; returns its size."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if shutil.disk_usage(path.parent).free < file.bytes:
        raise UserError(f"{path}: {file.bytes / 1e6:.0f} MB, more than the disk has left")
    part, digest, done, tenth = path.with_name(f"{path.name}.part"), hashlib.sha256(), 0, 1
    try:
        with part.open("wb") as out:
            while done < file.bytes:
                data = _asked(camera, "read", file=kind, offset=done).data
                if not data:
                    raise UserError(f"{camera.name} on {camera.host}: {path.name} has become shorter")
                out.write(data)
                digest.update(data)
                done += len(data)
                if kind == "video" and done * 10 >= file.bytes * tenth and done < file.bytes:
                    tenth = done * 10 // file.bytes + 1
                    report(f"{camera.name} on {camera.host}: {done / 1e6:.0f} of {file.bytes / 1e6:.0f} MB copied")
        if digest.hexdigest() != file.sha256 or done != file.bytes:
            raise UserError(f"{camera.name} on {camera.host}: {path.name}: the copy is not the original: wrong checksum")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return done


def _asked(camera: RemoteCamera, what: Literal["files", "read"], **fields: object) -> FilmReply:
    """The reply to a query, which is repeated while there is none."""
    for last in (*[False] * (FETCH_TRIES - 1), True):
        try:
            return camera.ask(what, QUERY_S, **fields)
        except Unanswered:
            if last:
                raise
            time.sleep(POLL_S)
    raise AssertionError("the last try returns or raises")
