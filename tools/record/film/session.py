"""One film, from its cameras to its folder: of a rig, or of cameras that are not calibrated yet."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import FilmBoard
from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.common.runtime.signals import stop_signals
from zenocap.tools.record.film.camera import Filmed
from zenocap.tools.record.film.collect import check_fetch, collected
from zenocap.tools.record.film.film import film
from zenocap.tools.record.film.layout import late_texts, prepare, write_layout
from zenocap.tools.record.film.remote_film import NOBODY, RemoteFilm, cameras_of
from zenocap.tools.setup.cameras.away import Places, copy_commands, detect_commands


@dataclass(frozen=True)
class FilmRequest:
    """rig: None before there is a calibration.  seconds: None until it is stopped.

    force: whether to replace an earlier film.  fetch: whether to copy videos of other machines.  board: whose corners are
    copied in place of the videos that stay on other machines.
    """

    folder: Path
    rig: Rig | None
    viewers: Sequence[Viewer]
    seconds: float | None = None
    force: bool = False
    fetch: bool = False
    board: FilmBoard | None = None


@dataclass(frozen=True)
class FilmResult:
    """reason: why it ended early.  places: notes on the videos by camera.  failures: of copying."""

    request: FilmRequest
    filmed: Sequence[Filmed]
    remote: RemoteFilm
    reason: str
    places: Mapping[str, tuple[str, ...]]
    failures: Sequence[str]

    @property
    def is_empty(self) -> bool:
        return not any(one.frames for one in self.filmed)

    @property
    def is_whole(self) -> bool:
        return not self.reason and not self.failures and not any(map(losses, self.filmed))

    def away(self) -> Places:
        """Where the videos are that are not in the folder."""
        return {
            one.name: (printable(one.reply.host), printable(one.reply.folder, MAX_LINE))
            for one in self.remote.cameras
            if one.reply.frames and not (self.request.folder / f"videos/{one.name}.mkv").exists()
        }


def run_film(
    request: FilmRequest, options: ZenohOptions | None, report: Callable[[str], None], note: Callable[[str], None]
) -> FilmResult:
    """Film until the end of the request, or a signal.  options: None where no other program can have a camera.

    report, note: receive news and warnings.  Raises UserError and OSError.
    """
    folder, viewers, is_calibrated = request.folder, request.viewers, request.rig is not None
    own, remote = list(viewers), NOBODY
    prepare(folder, viewers, request.force, calibrated=is_calibrated)
    with ExitStack() as network:
        if options is not None:
            name = folder.resolve().name
            own, remote = network.enter_context(cameras_of(request.rig, viewers, options, name, note))
            if request.fetch:
                check_fetch(remote)
        with stop_signals() as stopped:
            filmed, reason = film(own, folder, request.seconds, stopped, report, remote=remote)
        result = FilmResult(request, filmed, remote, reason, {}, ())
        if result.is_empty:
            return result
        write_layout(folder, viewers, filmed, calibrated=is_calibrated, begins_empty=not remote.of_running_rig)
        places, failures = collected(remote, folder, fetch=request.fetch, report=report, board=request.board)
        return FilmResult(request, filmed, remote, reason, places, failures)


def losses(one: Filmed) -> list[str]:
    """What is missing from the film of a camera, in words."""
    found = [f"{one.lost} frames lost by the writer"] * bool(one.lost)
    found += [f"lost and opened again: {one.away}"] * bool(one.away)
    return [*found, *["no frame"] * (not one.frames)]


def lines_of(result: FilmResult) -> Iterator[tuple[str, bool]]:
    """Description of a film; whether each line is a warning."""
    for one in result.filmed:
        texts = "".join(f", {text}" for text in (*losses(one), *result.places.get(one.name, ())))
        yield f"{one.name}: {one.frames} frames, {one.rate:.2f} frames/s{texts}", False
    for text in (*result.failures, *(f"warning: {late}" for late in late_texts(result.request.viewers, result.filmed))):
        yield text, True
    if result.remote.cameras:
        yield result.remote.start_text(result.filmed), False
    if result.remote.of_running_rig:
        yield "note: of a running rig, so without empty_seconds: the background is the median of each video", True
    if result.reason:
        yield f"ended early: {result.reason}", True


def next_lines(result: FilmResult, board: str) -> list[str]:
    """What to do next, as commands to copy.  board: options that describe it."""
    request, folder = result.request, result.request.folder
    is_ready = request.rig is not None and request.board is None
    away = result.away()
    found = {name for name in away if request.board and (folder / CORNERS / f"{name}{CORNERS_SUFFIX}").exists()}
    missing = {name: place for name, place in away.items() if name not in found}
    if not missing:
        track = f"track {folder} -o {folder.resolve().name}.mcap"
        return [f"next: zenocap {track if is_ready else f'calibrate board {folder} {board}'}"]
    names = ", ".join(missing)
    if is_ready:
        lines = [f"next: copy videos/ and times/ of {names} into {folder}, then zenocap track {folder}"]
    else:
        lines = [
            f"next: detect the board of {names} where the videos are, and copy the corners into {folder}, then "
            f"zenocap calibrate board {folder} {board}",
            *(f"  {command}" for command in detect_commands(folder, missing, board)),
            "or copy the videos:",
        ]
    return [*lines, *(f"  {command}" for command in copy_commands(folder, missing))]
