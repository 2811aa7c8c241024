"""Film all cameras of a rig together, into a folder that `zenocap track` takes."""

import shutil
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import Announced
from zenocap.common.video.parameters import LOOK_S, RESERVE_BYTES, RESERVE_S
from zenocap.common.video.video_writer import VideoWriter
from zenocap.services.viewer.sources.source import camera_images
from zenocap.tools.record.film.camera import Filmed, LocalCamera, Opener
from zenocap.tools.record.film.parameters import ESTIMATE_S, LEAD_S, READY_S
from zenocap.tools.record.film.remote_film import NOBODY, RemoteFilm, disk_text


def filmed_viewers(rig: Rig) -> list[Viewer]:
    """Viewers whose source is a camera or stream.  Raises UserError when there is none."""
    found = [viewer for viewer in rig.viewers if viewer.source.live or isinstance(viewer.source, Announced)]
    if not found:
        raise UserError(f"rig {rig.name}: no viewer has a camera or stream as source: nothing to film")
    return found


def film(
    viewers: Sequence[Viewer],
    folder: Path,
    seconds: float | None,
    stopped: Callable[[], bool],
    report: Callable[[str], None],
    opener: Opener = camera_images,
    free_bytes: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free,
    remote: RemoteFilm = NOBODY,
) -> tuple[list[Filmed], str]:
    """Film until `stopped`, for `seconds`, or until the disk is nearly full; returns the films, and why they ended early.

    viewers: whose cameras this program opens.  remote: cameras that other programs have; one that fails does not end the
    film of the others.  All cameras give images before the first is written.  Raises UserError.
    """
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    (folder / "times").mkdir(exist_ok=True)
    if free_bytes(folder) < RESERVE_BYTES:
        raise UserError(f"{folder}: {free_bytes(folder) / 1e6:.0f} MB free: allowed: at least {RESERVE_BYTES / 1e6:.0f} MB")
    stop = threading.Event()
    cameras = [LocalCamera(viewer, _writer(viewer, folder), opener, stop) for viewer in viewers]
    for camera in cameras:
        camera.start()
    reason = ""
    try:
        remote.open()
        _wait_until_ready(cameras, remote, stop, stopped)
        begin_ns = time.time_ns() + (round(LEAD_S * 1e9) if remote.cameras else 0)
        for camera in cameras:
            camera.end_ns = None if seconds is None else begin_ns + round(seconds * 1e9)
            camera.begin_ns = begin_ns
        if not stop.is_set() and not stopped():
            remote.start(begin_ns, round((seconds or 0.0) * 1e9))
            report(f"filming {len(cameras) + len(remote.cameras)} cameras{remote.describe()}")
            reason = _until_end(cameras, remote, stop, folder, begin_ns, seconds, stopped, report, free_bytes)
    finally:
        stop.set()
        remote.stop()
        for camera in cameras:
            camera.join()
            if not camera.writer.frames:  # nothing that a second try would have to replace
                camera.writer.remove()
    for camera in cameras:
        if isinstance(camera.failure, UserError) and not camera.writer.frames:
            raise camera.failure
        if camera.failure is not None:
            reason = f"{camera.result.name}: {camera.failure}"
    filmed = [*(camera.result for camera in cameras), *remote.filmed()]
    for one in filmed:
        one.begin_ns = begin_ns
    return filmed, "; ".join(filter(None, (reason, *remote.failures)))


def _writer(viewer: Viewer, folder: Path) -> VideoWriter:
    name = viewer.camera.name
    return VideoWriter(
        folder / "videos" / f"{name}.mkv", folder / "times" / f"{name}.csv", viewer.calibrated_size, viewer.fps
    )


def _wait_until_ready(
    cameras: Sequence[LocalCamera], remote: RemoteFilm, stop: threading.Event, stopped: Callable[[], bool]
) -> None:
    end_s = time.monotonic() + READY_S
    while not stop.is_set() and not stopped():
        late = [*(camera.result.name for camera in cameras if not camera.ready.is_set()), *remote.not_ready]
        if not late:
            return
        if time.monotonic() > end_s:
            raise UserError(f"{', '.join(late)}: no image within {READY_S:.0f} s: see zenocap cameras")
        time.sleep(0.02)


def _until_end(
    cameras: Sequence[LocalCamera],
    remote: RemoteFilm,
    stop: threading.Event,
    folder: Path,
    begin_ns: int,
    seconds: float | None,
    stopped: Callable[[], bool],
    report: Callable[[str], None],
    free_bytes: Callable[[Path], int],
) -> str:
    """Wait for the end; returns why it is early, else an empty text."""
    estimated, looked_s = False, 0.0
    while not stopped() and not stop.is_set():
        passed_s = (time.time_ns() - begin_ns) / 1e9
        if seconds is not None and passed_s >= seconds and (remote.has_ended or passed_s >= seconds + 2 * LEAD_S):
            return ""
        if remote.cameras and not cameras and remote.has_ended:
            return ""
        if passed_s - looked_s >= LOOK_S:
            looked_s = passed_s
            for text in remote.news():
                report(text)
            written = sum(camera.writer.bytes for camera in cameras)
            rate, free = written / passed_s, free_bytes(folder)
            if cameras and free < RESERVE_BYTES + RESERVE_S * rate:
                return f"the disk is nearly full: {free / 1e6:.0f} MB are left"
            if not estimated and passed_s >= ESTIMATE_S:
                estimated, left_s = True, None if seconds is None else seconds - passed_s
                if cameras:
                    report(disk_text(rate, free, left_s))
                for text in remote.disk_texts(passed_s, left_s):
                    report(text)
        time.sleep(0.02)
    return ""
