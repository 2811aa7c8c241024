"""The live page of cameras: pictures and measures of all of them, and what a mode adds."""

import threading
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Protocol
from weakref import WeakKeyDictionary

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.sources import Device, VideoFile
from zenocap.common.runtime.service_info import versions
from zenocap.common.vision.pictures import jpeg
from zenocap.common.web.broadcast import EncodedUpdate, PageQueue
from zenocap.common.web.content import PageContent, page_files
from zenocap.common.web.page import Page
from zenocap.services.viewer.frame import Frame
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page import parameters as p
from zenocap.tools.setup.page.advice import rows
from zenocap.tools.setup.page.camera import LiveCamera


class PageMode(Protocol):
    """What a page does besides pictures and measures.  Called by the loop of the page only, in its thread."""

    @property
    def name(self) -> lm.ModeName: ...

    @property
    def hidden(self) -> Collection[str]:
        """Keys of measures that say nothing in this mode."""

    @property
    def finished(self) -> bool:
        """Whether the command is to end."""

    def corners(self, camera: LiveCamera, frame: Frame) -> Floats | None:
        """Corners (n, 2) px to be drawn into the picture of a frame; None where no board is searched."""

    def tick(self) -> Sequence[EncodedUpdate]:
        """Work that is due, and updates of the page."""

    def receive(self, command: lm.Command) -> None:
        """Handle a command.  Raises UserError with the reason for one that is refused."""


class CamerasOnly:
    """No more than pictures and measures."""

    name: lm.ModeName = "cameras"
    hidden: Collection[str] = ()
    finished = False

    def corners(self, camera: LiveCamera, frame: Frame) -> Floats | None:
        return None

    def tick(self) -> Sequence[EncodedUpdate]:
        return ()

    def receive(self, command: lm.Command) -> None:
        raise UserError("this page shows the cameras only")


@dataclass
class _Shown:
    """What the pages have of one camera."""

    frame: Frame | None = None
    picture_s: float = -1e9
    measured_s: float = -1e9


class LivePage:
    """Serves the page of cameras from `open` to `close`; `run` between them."""

    def __init__(self, cameras: Sequence[LiveCamera], table: PageTable, program: str, mode: PageMode) -> None:
        """program: the command, for messages."""
        self._cameras, self._mode = cameras, mode
        files = page_files("zenocap.tools.setup.page")
        content: PageContent[lm.Command] = PageContent(files, lm.decode_command, program, "--")
        self._page = Page(table, content, self._enlarge)
        self._large: WeakKeyDictionary[PageQueue, str] = WeakKeyDictionary()
        self._large_lock = threading.Lock()
        self._shown = {camera.name: _Shown() for camera in cameras}
        self._openings = 0  # of the page, at the last turn

    @property
    def address(self) -> str:
        """URL of the page, token included."""
        return self._page.address

    def open(self) -> None:
        """Serve the page.  Raises UserError."""
        self._page.open()
        entries = [lm.CameraEntry(one.name, _source_text(one), self._settles(one), _expected(one)) for one in self._cameras]
        self._page.publish("hello", lm.CameraHelloUpdate(self._mode.name, versions()["zenocap"], entries))

    def close(self) -> None:
        self._page.close()

    def run(self, stopped: Callable[[], bool]) -> None:
        """Run until `stopped`, or the mode is finished."""
        self._page.run(lambda: stopped() or self._mode.finished, self._handle, self._turn, p.POLL_S)

    def _turn(self) -> bool:
        """Publish what is due; returns whether there was anything."""
        if self._page.openings != self._openings:
            self._openings = self._page.openings
            self._forget_pictures()
        busy = any([self._show(camera) for camera in self._cameras])
        updates = self._mode.tick()
        if updates:
            self._page.updates.publish(None, updates)
        return busy

    def _forget_pictures(self) -> None:
        """Send the last picture again also of a source without another one."""
        for shown in self._shown.values():
            shown.frame = None

    def _settles(self, camera: LiveCamera) -> bool:
        """Not during a calibration, in which the focus has to stay."""
        return self._mode.name == "cameras" and isinstance(camera.viewer.source, Device)

    def _show(self, camera: LiveCamera) -> bool:
        shown, now_s, frame = self._shown[camera.name], time.monotonic(), camera.newest
        busy = False
        if frame is not None and frame is not shown.frame and now_s - shown.picture_s >= p.PICTURE_PERIOD_S:
            shown.frame, shown.picture_s, busy = frame, now_s, True
            corners = self._mode.corners(camera, frame)
            if self._page.pages:
                height, width = frame.image.shape[:2]
                flat = None if corners is None else [round(float(value), 1) for value in corners.ravel()]
                with self._large_lock:
                    large = camera.name in self._large.values()
                data = jpeg(frame.image, *((p.LARGE_PX, p.LARGE_JPEG_QUALITY) if large else (p.TILE_PX, p.JPEG_QUALITY)))
                self._page.publish(f"picture/{camera.name}", lm.PictureUpdate(camera.name, width, height, data, flat))
        if now_s - shown.measured_s >= p.MEASURE_PERIOD_S and self._page.pages:
            shown.measured_s, busy = now_s, True
            found = [row for row in rows(camera.measures()) if row.key not in self._mode.hidden]
            self._page.publish(f"state/{camera.name}", lm.StateUpdate(camera.name, self._problem(camera), found))
        return busy

    def _problem(self, camera: LiveCamera) -> str:
        """A picture, or a video that has ended, is enough to place points in it."""
        return "" if self._mode.name == "points" and camera.ended else camera.problem

    def _handle(self, command: lm.Command) -> None:
        match command:
            case lm.Anew():
                for camera in self._cameras:
                    camera.measure_anew()
            case lm.Settle(camera=name):
                for camera in self._cameras:
                    if camera.name == name and self._settles(camera):
                        camera.settle()
            case _:
                self._mode.receive(command)

    def _enlarge(self, page: PageQueue, command: lm.Command) -> bool:
        """In the server's thread: which camera a page shows enlarged."""
        if not isinstance(command, lm.Enlarge):
            return False
        with self._large_lock:
            self._large[page] = command.camera
        self._forget_pictures()
        return True


def wait_for_images(cameras: Sequence[LiveCamera], stopped: Callable[[], bool], seconds: float = p.READY_S) -> None:
    """Wait for the first image of any camera.  Raises the failure of the first one when none can be opened."""
    end_s = time.monotonic() + seconds
    while not stopped() and time.monotonic() < end_s and not any(one.newest is not None for one in cameras):
        if all(one.failure is not None for one in cameras):
            break
        time.sleep(p.POLL_S)
    failures = [one.failure for one in cameras]
    if failures and failures[0] is not None and all(one is not None for one in failures):
        raise failures[0]


def _source_text(camera: LiveCamera) -> str:
    source = camera.viewer.source
    if source.live:
        return source.shown
    return source.path.name if isinstance(source, VideoFile) else type(source).__name__.lower()


def _expected(camera: LiveCamera) -> tuple[int, int] | None:
    """Size of the calibration; None for a camera without one."""
    lens_known = camera.viewer.camera.translation.any()
    return camera.viewer.calibrated_size if lens_known else None
