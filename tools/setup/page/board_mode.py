"""Page that guides a person with a printed board, and calibrates the cameras."""

import logging
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.lens import Lens
from zenocap.common.errors import UserError
from zenocap.common.vision.image_measures import grey_of
from zenocap.common.web.broadcast import EncodedUpdate, encoded
from zenocap.services.viewer.frame import Frame
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_calibration import BoardCalibration, calibrated_rig
from zenocap.tools.setup.calibration.board_detection import BoardDetector, why_not_found
from zenocap.tools.setup.calibration.board_report import report, verdict
from zenocap.tools.setup.calibration.board_views import CameraViews, View, with_velocities
from zenocap.tools.setup.calibration.parameters import CELLS
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page.board_guide import REGIONS, BoardGuide, CameraProgress
from zenocap.tools.setup.page.board_search import Burst, VariantSearch, searched
from zenocap.tools.setup.page.camera import LiveCamera
from zenocap.tools.setup.page.parameters import BURST_PERIOD_S, MAX_VIEWS, MIN_MOMENTS, WHY_PERIOD_S

logger = logging.getLogger(__name__)
MOST_FLOORS = 20  # each is searched in all images; chosen by hand
WAIT_S = 0.05  # between looks whether a stretch of images is due; chosen by hand
END_S = 1.0  # for the threads to end; a calibration that runs goes on until the process ends; chosen by hand

Search = Callable[[Board, Sequence[Sequence[Frame]], Sequence[float], int], Burst]
"""See `board_search.searched`."""

Written = Callable[[BoardCalibration], str]
"""Writes a calibration and returns the name of the file."""


@dataclass
class _Seen:
    """What was collected of one camera.  size: (width, height) px; None before its first image."""

    size: tuple[int, int] | None = None
    looks: int = 0
    views: list[View] = field(default_factory=list)


class BoardMode:
    """Searches the board in a thread, guides, and calibrates in another one."""

    name: lm.ModeName = "board"
    hidden: Collection[str] = ("focus", "drift", "flicker")  # a board that moves changes them

    def __init__(
        self,
        cameras: Sequence[LiveCamera],
        board: Board,
        epoch_ns: int,
        write: Written,
        lenses: Mapping[str, Lens] | None = None,
        delays: bool = True,
        search: Search = searched,
    ) -> None:
        """epoch_ns: time 0 of the views.  lenses, delays: see `calibrated_rig`."""
        self._find = search
        self._cameras, self._epoch_ns, self._write = cameras, epoch_ns, write
        self._lenses, self._delays = lenses, delays
        self._variant = VariantSearch(board)
        self._detector = BoardDetector(board)
        self._lock = threading.Lock()
        self._seen = [_Seen() for _ in cameras]
        self._guide = self._new_guide()
        self._floors: list[float] = []
        self._busy = self._why = ""
        self.result: BoardCalibration | None = None
        self.finished = False
        self._result: lm.BoardResult | None = None
        self._ended = threading.Event()
        self._last_seen_s = time.monotonic()
        self._version, self._sent = 0, -1
        self._threads = [threading.Thread(target=self._search, name="board", daemon=True)]
        self._threads[0].start()

    def close(self) -> None:
        """End the threads."""
        self._ended.set()
        for thread in self._threads:
            thread.join(END_S)

    def corners(self, camera: LiveCamera, frame: Frame) -> Floats | None:
        if self._busy:
            return np.zeros((0, 2))
        grey = grey_of(frame.image)
        if not self._variant.known and self._variant.add(grey):
            self._detector = BoardDetector(self._variant.board)
        found = self._detector.corners(grey)
        return np.zeros((0, 2)) if found is None else found[1]

    def tick(self) -> Sequence[EncodedUpdate]:
        with self._lock:
            if self._version == self._sent:
                return ()
            self._sent = self._version
            return [encoded("board", self._update())]

    def receive(self, command: lm.Command) -> None:
        with self._lock:
            self._version += 1
            match command:
                case lm.Finish() | lm.Discard() if self._busy:  # else its result would be that of the discarded views
                    name = type(command).__name__
                    raise UserError(f"the calibration runs: {name} when it is done; Ctrl-C ends without it")
                case lm.Finish():
                    self.finished = True
                case lm.Floor() if len(self._floors) >= MOST_FLOORS:
                    raise UserError(f"the board was on the floor {MOST_FLOORS} times: allowed: no more")
                case lm.Floor():
                    self._floors.append((time.time_ns() - self._epoch_ns) / 1e9)
                case lm.Discard():
                    self._seen = [_Seen(size=one.size) for one in self._seen]
                    self._guide, self._floors, self._result = self._new_guide(), [], None
                case lm.Calibrate() if not self._busy:
                    self._check_complete()
                    self._busy = "calibrating"
                    seen = [replace(one, views=list(one.views)) for one in self._seen]
                    floors = list(self._floors)
                    self._threads.append(threading.Thread(target=self._calibrate, args=(seen, floors), daemon=True))
                    self._threads[-1].start()
                case lm.Calibrate():
                    raise UserError("the calibration runs already")
                case _:
                    raise UserError(f"{type(command).__name__}: not on this page")

    def _new_guide(self) -> BoardGuide:
        progress = [
            CameraProgress(camera.name, seen.size or camera.viewer.calibrated_size)
            for camera, seen in zip(self._cameras, self._seen, strict=True)
        ]
        return BoardGuide(self._variant.board.corners, progress, self._lenses is not None)

    def _check_complete(self) -> None:
        """Raise UserError while a calibration would be in pieces."""
        unseen = [one.name for one in self._guide.cameras if not one.moments]
        if unseen:
            raise UserError(f"not yet: {', '.join(unseen)} has not seen the board")
        if self._guide.missing:
            main = self._guide.cameras[self._guide.groups()[0][0]].name
            raise UserError(
                f"not yet: {', '.join(self._guide.missing)} is not connected with {main}: both have to see the board at "
                f"the same time, at {MIN_MOMENTS} places"
            )

    def _search(self) -> None:
        """Search a stretch of images every BURST_PERIOD_S, until the end."""
        due_s = time.monotonic() + BURST_PERIOD_S
        while not self._ended.wait(WAIT_S):
            if time.monotonic() < due_s or self._busy:
                continue
            try:
                self._look()
            except Exception as error:  # the page must not wait for ever
                logger.exception("searching the board failed")
                with self._lock:
                    self._why, self._version = f"searching it failed: {error}", self._version + 1
            due_s = max(due_s + BURST_PERIOD_S, time.monotonic())

    def _look(self) -> None:
        """Search the board in the last stretch of images."""
        recent = [camera.recent if not camera.problem else [] for camera in self._cameras]
        burst = self._find(self._variant.board, recent, [camera.period_s for camera in self._cameras], self._epoch_ns)
        with self._lock:
            for number, (frames, seen) in enumerate(zip(recent, self._seen, strict=True)):
                if frames:
                    self._check_size(number, seen, frames[-1])
                    seen.looks += burst.looks.get(number, 0)
                    seen.views += burst.views.get(number, ())
                    del seen.views[:-MAX_VIEWS]
                    for view in burst.views.get(number, ()):
                        self._guide.add_cells(number, view)
            self._guide.add(burst.moment)
            self._version += 1
        self._explain(bool(burst.moment), [frames[-1] for frames in recent if frames])

    def _check_size(self, number: int, seen: _Seen, frame: Frame) -> None:
        """Begin again where the size of the images has changed."""
        size = (frame.image.shape[1], frame.image.shape[0])
        if seen.size == size:
            return
        if seen.views:
            self._seen[:] = [_Seen(size=one.size) for one in self._seen]
        self._seen[number].size = size
        self._guide = self._new_guide()

    def _explain(self, seen: bool, frames: Sequence[Frame]) -> None:
        """Find out why no camera has seen the board for WHY_PERIOD_S."""
        now_s = time.monotonic()
        if seen or self._guide.pairs or any(one.moments for one in self._guide.cameras):
            self._last_seen_s, self._why = now_s, ""
        elif frames and now_s - self._last_seen_s > WHY_PERIOD_S:
            why = why_not_found(self._variant.board, [grey_of(frame.image) for frame in frames])
            with self._lock:
                self._last_seen_s, self._why, self._version = time.monotonic(), why, self._version + 1

    def _camera_views(self, every: Sequence[_Seen]) -> list[CameraViews]:
        found = []
        for camera, seen in zip(self._cameras, every, strict=True):
            assert seen.size is not None
            views = with_velocities(seen.views, camera.period_s)
            found.append(CameraViews(camera.name, seen.size, camera.period_s, seen.looks, views))
        return found

    def _calibrate(self, seen: Sequence[_Seen], floors: list[float]) -> None:
        def progress(step: str) -> None:
            with self._lock:
                self._busy, self._version = f"calibrating: {step}", self._version + 1

        try:
            views = self._camera_views(seen)
            found = calibrated_rig(self._variant.board, views, self._lenses, floors, self._delays, progress)
            word, reasons = verdict(found)
            written = self._write(found)
            self.result, result = found, lm.BoardResult(word, reasons, report(found), written)
        except UserError as error:
            result = lm.BoardResult("failed", [str(error)], [], "")
        except Exception as error:  # the page must not wait for ever
            result = lm.BoardResult("failed", [f"the calibration failed: {error}"], [], "")
        with self._lock:
            self._busy, self._result, self._version = "", result, self._version + 1

    def _update(self) -> lm.BoardUpdate:
        guide = self._guide
        sentence, about, region = guide.advice()
        if self._busy:
            sentence = "Calibrating: wait."
        elif self._why and not any(one.moments for one in guide.cameras):
            sentence = f"No camera finds the board: {self._why}."
        elif self._result is not None and self._result.verdict == "good":
            sentence = "The calibration is good and written: press Finish."
        elif self._result is not None:
            sentence = f"{self._result.reasons[0]}. Then calibrate again."
        elif guide.ready and self._floors:
            sentence = "Enough: press Calibrate."
        cells = next((one for one in REGIONS if one[0] == region), None)
        asked = np.zeros((CELLS[1], CELLS[0]), dtype=np.bool_)
        if cells is not None:
            asked[cells[2], cells[1]] = True
        return lm.BoardUpdate(
            sentence=sentence,
            ready=guide.ready,
            missing=guide.missing,
            cameras=[
                lm.BoardCamera(
                    name=one.name,
                    moments=one.moments,
                    coverage=one.coverage,
                    cells=[int(value) for value in one.cells],
                    asked=[int(value) for value in asked.ravel()] if one.name == about else [],
                    sides=one.sides,
                    enough=one.enough,
                )
                for one in guide.cameras
            ],
            edges=[lm.BoardEdge(one, other, count, count >= MIN_MOMENTS) for (one, other), count in guide.pairs.items()],
            across=CELLS[0],
            floors=len(self._floors),
            busy=self._busy,
            result=self._result,
        )
