"""Collection of a film's videos or corners from other programs."""

import hashlib
import os
import shutil
import socket
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Literal

from zenocap.common.errors import UserError
from zenocap.common.formats.model_files import MAX_BYTES
from zenocap.common.messages import FilmBoard, FilmFile, FilmReply
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.runtime.signals import WAIT_S
from zenocap.common.video.parameters import RESERVE_BYTES
from zenocap.services.camera.files import Kind
from zenocap.tools.record.film.parameters import CHECKSUM_S, DETECT_S, FETCH_TRIES, FILE_BYTES, FRAME_BYTES, POLL_S, QUERY_S
from zenocap.tools.record.film.remote import RemoteCamera, Unanswered
from zenocap.tools.record.film.remote_film import RemoteFilm

FILES: dict[Kind, str] = {"video": "videos/{name}.mkv", "times": "times/{name}.csv"}


def check_fetch(remote: RemoteFilm) -> None:
    """Raises UserError when a film could not be copied afterwards."""
    for camera in remote.cameras:
        if not (remote.secured and camera.reply.may_read) and camera.reply.host != socket.gethostname():
            raise UserError(
                f"{camera.name} on {camera.host}: pictures do not leave that machine: allowed with --fetch: a rig with "
                "certificates (zenocap certs); without --fetch the film is made, and the commands that copy it are printed"
            )


def collected(
    remote: RemoteFilm, folder: Path, *, fetch: bool, report: Callable[[str], None], board: FilmBoard | None = None
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Bring the videos of other programs into `folder`: those on this machine, and with `fetch` and certificates all.

    board: whose corners are brought in place of the videos that stay; None: none.  Returns notes by camera, and failures.
    """
    notes: dict[str, tuple[str, ...]] = {}
    failures: list[str] = []
    away: list[RemoteCamera] = []
    for camera in remote.cameras:
        notes[camera.name] = ()
        if not camera.reply.frames:
            continue
        place = f"{camera.host}:{printable(camera.reply.folder)}"
        try:
            if is_here(camera):
                move(camera, folder)
            elif fetch and remote.secured:
                size, seconds = copy(camera, folder, report)
                rate = size / 1e6 / max(seconds, 1e-3)
                notes[camera.name] = (f"{size / 1e6:.1f} MB copied from {place} at {rate:.0f} MB/s",)
            else:
                notes[camera.name] = (f"on {place}",)
                away.append(camera)
        except (UserError, OSError) as error:
            notes[camera.name] = (f"on {place}",)
            failures.append(f"{camera.name}: not copied: {error}")
    if board is not None and away:
        report(f"searching the board where the films are: {', '.join(f'{one.name} on {one.host}' for one in away)}")
        ended = threading.Event()  # also by Ctrl-C: a search may take an hour
        with ThreadPoolExecutor(len(away)) as pool:
            found = [pool.submit(_corners, camera, folder, board, ended) for camera in away]
            try:
                while wait(found, WAIT_S).not_done:
                    pass
            finally:
                ended.set()
            for camera, one in zip(away, found, strict=True):
                note, failure = one.result()
                notes[camera.name] += (note,) * bool(note)
                failures += [f"{camera.name}: no corners: {failure}"] * bool(failure)
    return notes, failures


def _corners(camera: RemoteCamera, folder: Path, board: FilmBoard, ended: threading.Event) -> tuple[str, str]:
    """Note and failure of the corners of one camera.  ended: whether they are not waited for any more."""

    def pause(seconds: float) -> None:
        if ended.wait(seconds):
            raise UserError(f"{camera.name} on {camera.host}: not waited for")

    try:
        return f"its corners copied, {copy_corners(camera, folder, board, pause) / 1e6:.1f} MB", ""
    except (UserError, OSError) as error:
        return "", f"{error}"


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
    told, more = camera.reply, camera.reply.frames * FRAME_BYTES + FILE_BYTES
    sizes = _checksums(camera, tuple(FILES))
    limits: dict[Kind, int] = {"video": told.written_bytes + more, "times": more}
    for kind, most in limits.items():
        if (size := sizes[kind].bytes) > most:
            raise UserError(
                f"{camera.name} on {camera.host}: {kind}: {size} bytes: allowed: {most} after {told.frames} frames"
            )
    for kind, file in sizes.items():
        total += _copy(camera, kind, file, folder / FILES[kind].format(name=camera.name), report)
    return total, time.monotonic() - begin_s


def copy_corners(camera: RemoteCamera, folder: Path, board: FilmBoard, pause: Callable[[float], object]) -> int:
    """Have a board searched in the film of a camera, and copy the checked corners into `folder`; returns bytes.

    pause: between two questions, seconds.  Raises UserError, OSError, and what `pause` raises.
    """
    from zenocap.tools.setup.calibration.board import checked_board
    from zenocap.tools.setup.calibration.corners_file import check_board, read_corners

    _asked(camera, "detect", board=board)
    end_s = time.monotonic() + DETECT_S
    while (reply := _asked(camera, "state")).board == "searching":
        if time.monotonic() > end_s:
            raise UserError(f"{camera.name} on {camera.host}: the board is not searched within {DETECT_S:.0f} s")
        pause(POLL_S)
    if reply.board != "found":
        raise UserError(f"{camera.name} on {camera.host}: {printable(reply.board_failure) or 'no board is searched'}")
    file = _checksums(camera, ("corners",), pause)["corners"]
    if file.bytes > MAX_BYTES:
        raise UserError(f"{camera.name} on {camera.host}: {file.bytes} bytes of corners: allowed: at most {MAX_BYTES}")
    path = folder / CORNERS / f"{camera.name}{CORNERS_SUFFIX}"
    _copy(camera, "corners", file, path, lambda _: None)
    try:
        found = read_corners(path)
        if found.camera != camera.name:
            raise UserError(f"{path}: camera = {found.camera!r}: allowed: {camera.name}")
        described = (board.square_mm, board.marker_mm, board.dictionary, board.spacing)
        check_board(path, found.board, checked_board(board.kind, board.columns, board.rows, *described))
    except UserError:
        path.unlink()
        raise
    return file.bytes


def _checksums(
    camera: RemoteCamera, kinds: Sequence[Kind], pause: Callable[[float], object] = time.sleep
) -> dict[Kind, FilmFile]:
    """Sizes and checksums of these files, once they are all known."""
    end_s = time.monotonic() + CHECKSUM_S
    while True:
        files = _asked(camera, "files", file=kinds[0]).files
        if set(files) != set(kinds):
            raise UserError(f"{camera.name} on {camera.host}: its files are gone")
        if all(file.sha256 for file in files.values()):
            return dict(files)
        if time.monotonic() > end_s:
            raise UserError(f"{camera.name} on {camera.host}: no checksum within {CHECKSUM_S:.0f} s")
        pause(POLL_S / 5)


def _copy(camera: RemoteCamera, kind: Kind, file: FilmFile, path: Path, report: Callable[[str], None]) -> int:
    """Copy one file; returns its size."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part, digest, done, tenth = path.with_name(f"{path.name}.part"), hashlib.sha256(), 0, 1
    try:
        with part.open("wb") as out:
            while done < file.bytes:
                spare = shutil.disk_usage(path.parent).free - RESERVE_BYTES
                if spare < file.bytes - done:
                    raise UserError(
                        f"{path}: {file.bytes / 1e6:.0f} MB: allowed: {max(0, spare + done) / 1e6:.0f} MB, free disk"
                    )
                data = _asked(camera, "read", file=kind, offset=done).data
                if not 0 < len(data) <= file.bytes - done:
                    raise UserError(
                        f"{camera.name} on {camera.host}: {path.name}: not the {file.bytes} bytes that it announced"
                    )
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


def _asked(camera: RemoteCamera, what: Literal["state", "files", "read", "detect"], **fields: object) -> FilmReply:
    """The reply to a query, which is repeated while there is none."""
    for last in (*[False] * (FETCH_TRIES - 1), True):
        try:
            return camera.ask(what, QUERY_S, **fields)
        except Unanswered:
            if last:
                raise
            time.sleep(POLL_S)
    raise AssertionError("the last try returns or raises")
