"""Page of points in the pictures of all cameras; a thread solves the cameras meanwhile."""

import logging
import threading
import time
from collections.abc import Collection, Sequence
from dataclasses import replace

import msgspec
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.vision.pictures import jpeg
from zenocap.common.web.broadcast import EncodedUpdate, encoded
from zenocap.services.viewer.frame import Frame
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page import point_messages as pm
from zenocap.tools.setup.page.camera import LiveCamera
from zenocap.tools.setup.page.parameters import FINISH_HINT_S, STILL_JPEG_QUALITY, STILL_PX
from zenocap.tools.setup.page.points_edit import cleared, edited, measured, picked
from zenocap.tools.setup.page.points_task import Placed, PointsTask, Solution

logger = logging.getLogger(__name__)
END_S = 1.0  # for the thread to end; chosen by hand
MEASURES = ("rate", "jitter", "focus", "exposure", "noise", "drift", "flicker")


class Stills:
    """The pictures in which points are placed: one still image of each camera, until another is asked for.

    sizes: (width, height) px of the pictures so far, by camera.
    """

    def __init__(self, cameras: Sequence[LiveCamera]) -> None:
        self._cameras = {camera.name: camera for camera in cameras}
        self._asked = set(self._cameras)
        self.sizes: dict[str, tuple[int, int]] = {}

    def ask(self, name: str) -> None:
        """Take the newest image of a camera as its picture.  Raises UserError."""
        if name not in self._cameras:
            raise UserError(f"{name}: no such camera; there are: {', '.join(self._cameras)}")
        if self._cameras[name].newest is None:
            raise UserError(f"{name}: no image yet: {self._cameras[name].problem}")
        self._asked.add(name)

    def due(self) -> list[EncodedUpdate]:
        """Pictures that were asked for and have come."""
        found = []
        for name in sorted(self._asked):
            if (frame := self._cameras[name].newest) is None:
                continue
            self._asked.discard(name)
            height, width = frame.image.shape[:2]
            self.sizes[name] = width, height
            update = pm.StillUpdate(name, width, height, jpeg(frame.image, STILL_PX, STILL_JPEG_QUALITY))
            found.append(encoded(f"still/{name}", update))
        return found


class PointsMode:
    """Holds points and picks, and publishes them with what follows.  solution: that was written last; None before.

    written: names of the files that were written.
    """

    name: lm.ModeName = "points"
    hidden: Collection[str] = MEASURES

    def __init__(self, cameras: Sequence[LiveCamera], task: PointsTask) -> None:
        self._cameras, self._task = cameras, task
        self._stills = Stills(cameras)
        self._placed = task.start()
        self._solution: Solution | None = None
        self._solved_for: Placed | None = None
        self._saved_for: Placed | None = self._placed
        self.written: list[str] = []
        self._failure = ""
        self._finish_s = -1e9
        self.solution: Solution | None = None
        self.finished = False
        self._sent: pm.PointTaskUpdate | None = None
        self._lock, self._changed, self._ended = threading.Lock(), threading.Event(), threading.Event()
        self._changed.set()
        self._thread = threading.Thread(target=self._solve, name="points", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ended.set()
        self._changed.set()
        self._thread.join(END_S)

    def corners(self, camera: LiveCamera, frame: Frame) -> Floats | None:
        """The picks, for the small picture."""
        with self._lock:
            picks = list(self._placed.picks.get(camera.name, {}).values())
        return np.array(picks, dtype=np.float64).reshape(-1, 2)

    def tick(self) -> Sequence[EncodedUpdate]:
        updates = self._stills.due()
        with self._lock:
            if updates:
                self._set(replace(self._placed, sizes=dict(self._stills.sizes)))
            update = self._update()
        if update != self._sent:
            self._sent = update
            updates.append(encoded("points", update))
        return updates

    def receive(self, command: lm.Command) -> None:
        with self._lock:
            match command:
                case pm.NewPicture(camera=name):
                    self._stills.ask(name)
                case pm.Save():
                    self._save()
                case lm.Finish():
                    self._finish()
                case pm.Pick(camera=name, point=point, pixel=pixel):
                    self._set(picked(self._placed, name, point, pixel))
                case pm.ClearPicks(camera=name):
                    self._set(cleared(self._placed, name))
                case pm.SetField(key=key, value=value):
                    self._set(self._task.completed(measured(self._placed, key, value)))
                case pm.SetPoint() | pm.RenamePoint() | pm.RemovePoint() if self._task.editable:
                    self._set(edited(self._placed, command))
                case _:
                    raise UserError(f"{type(command).__name__}: not on this page")

    def _set(self, placed: Placed) -> None:
        self._placed = placed
        self._changed.set()

    def _save(self) -> None:
        if self._solution is None or self._solved_for is not self._placed:  # not solved meanwhile
            self._solution, self._solved_for = self._task.solve(self._placed), self._placed
        self.written = self._task.write(self._placed, self._solution)
        self._saved_for, self.solution = self._placed, self._solution

    def _finish(self) -> None:
        now_s = time.monotonic()
        if self._unsaved and now_s - self._finish_s > FINISH_HINT_S:
            self._finish_s = now_s
            raise UserError("there are changes that are not saved: press Save, or Finish again to leave them")
        self.finished = True

    @property
    def _unsaved(self) -> bool:
        """Whether points, picks or measures differ from those that were saved; pictures do not count."""
        saved = self._saved_for
        assert saved is not None
        return replace(self._placed, sizes={}) != replace(saved, sizes={})

    def _solve(self) -> None:
        """Solve the newest points whenever they have changed, until the end."""
        while True:
            self._changed.wait()
            self._changed.clear()
            if self._ended.is_set():
                return
            with self._lock:
                placed = self._placed
            solution, failure = None, ""
            try:
                solution = self._task.solve(placed)
            except UserError as error:
                failure = str(error)
            except Exception as error:  # the page must not wait for ever
                logger.exception("solving the cameras failed")
                failure = f"solving the cameras failed: {error}"
            with self._lock:
                self._solution, self._failure = solution or self._solution, failure
                self._solved_for = placed if solution is not None else None

    def _update(self) -> pm.PointTaskUpdate:
        placed, solution = self._placed, self._solution
        views = [] if solution is None else list(solution.views)
        fresh = [_of_now(view, placed) for view in views]
        busy = self._solved_for is not placed and not self._failure
        sentence = "waiting for the pictures" if solution is None else solution.sentence
        verdict = "" if solution is None else solution.verdict
        if self._failure:
            sentence, verdict = self._failure, ""
        elif self.written and not self._unsaved and verdict != "poor":
            sentence = "Saved: press Finish."
        return pm.PointTaskUpdate(
            task=self._task.name,
            editable=self._task.editable,
            centre_lines=self._task.centre_lines,
            points=[pm.PointRow(name, place) for name, place in placed.points.items()],
            fields=self._task.fields(placed),
            cameras=fresh,
            sentence=sentence,
            verdict=verdict,
            reasons=[] if solution is None else list(solution.reasons),
            written=self.written,
            unsaved=self._unsaved,
            busy=busy,
        )


def _of_now(view: pm.PlacedView, placed: Placed) -> pm.PlacedView:
    """A solved view with the picks and the picture size of now: what was solved may be a moment older."""
    picks = dict(placed.picks.get(view.name, {}))
    return msgspec.structs.replace(view, picks=picks, size=placed.sizes.get(view.name))
