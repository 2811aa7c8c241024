"""Pictures and a video of the model drawn over the images of every view."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Image
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import is_lost, silhouette_mask
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import NO_VIEW, views_of
from zenocap.common.observe.bodies import NO_BODIES, Bodies, Posed, SourceBody, posed
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.video.film_writer import FilmWriter
from zenocap.services.animator.body_geometry import part_outlines
from zenocap.services.viewer.frame import Frame
from zenocap.tools.takes.track import TrackedFrameSet

LONG_SIDE_PX = 640  # of each view in the picture; chosen by hand
PER_ROW = 4  # views in a row; chosen by hand
DIMMED = 0.55  # brightness of the image behind the lines; chosen by hand
CAPTION_PX = 26  # height of the caption; chosen by hand
CONTOUR = (255, 255, 255)
LEFT, RIGHT, MIDDLE = (60, 150, 255), (255, 190, 60), (110, 220, 110)  # orange, blue, green (BGR)


class Overlay:
    """Writes frame-NNNNNN.png for every `every`-th frame, and overlay.mp4 of all, into `folder`."""

    def __init__(self, rig: Rig, folder: Path, every: int) -> None:
        """Raises UserError when the folder cannot be written."""
        self._rig, self._folder, self._every = rig, folder, every
        self._bodies: Bodies = NO_BODIES
        self._is_last_body = False
        self._film: FilmWriter | None = None
        self._last: dict[str, Image] = {}
        self._pictures = self._seen = 0
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"--overlay {folder}: cannot be created: {error.strerror or error}") from error

    def restart(self) -> None:
        """Begin again: what is added from now on replaces the pictures and the video."""
        self.finish()
        self._film, self._bodies, self._last = None, NO_BODIES, {}
        self._pictures = self._seen = 0

    def use_body(self, anatomy: Anatomy, bdp: Bdp) -> None:
        """Draw this body from now on: poses from both directions are those of the last body of their take."""
        self._bodies, self._is_last_body = {"tracker": SourceBody(anatomy, bdp)}, True

    def add(self, frame_set: TrackedFrameSet) -> None:
        """Draw one frame set, with the pose from both directions where it has one."""
        shown: Posed | None = None
        masks: dict[str, Image] = {}
        for message in frame_set.messages:
            match message:
                case m.Silhouette() as silhouette:
                    masks[silhouette.viewer] = silhouette_mask(silhouette)
                case m.UniversalBdp() | m.TrackerBdp() if self._is_last_body:
                    pass
                case _:
                    self._bodies, found = posed(self._bodies, message)
                    shown = found or shown  # the pose of both directions comes last
        for viewer in self._rig.viewers:
            frame = frame_set.frames.get(viewer.id)
            if frame is not None:
                self._last[viewer.id] = drawn(viewer, frame, masks.get(viewer.id), shown)
        if len(self._last) < len(self._rig.viewers):
            return
        picture = side_by_side([self._last[viewer.id] for viewer in self._rig.viewers])
        first = next(iter(frame_set.frames.values()))
        if self._seen % self._every == 0:
            self._pictures += 1
            name = f"{'initial' if first.initial else 'frame'}-{first.frame:06d}.png"
            cv2.imwrite(str(self._folder / name), picture)
        self._seen += 1
        if self._film is None:
            size = (picture.shape[1], picture.shape[0])
            try:
                self._film = FilmWriter(self._folder / "overlay.mp4", size, self._rig.viewers[0].fps)
            except OSError as error:
                raise UserError(f"--overlay {self._folder}: cannot be written: {error.strerror or error}") from error
        self._film.write(picture)

    def finish(self) -> int:
        """Close the video; return the number of pictures."""
        if self._film is not None:
            self._film.close()
        return self._pictures


def side_by_side(views: Sequence[Image]) -> Image:
    """Tile the views in rows of at most PER_ROW; the rest stays dark."""
    columns = min(len(views), PER_ROW)
    height, width = max(view.shape[0] for view in views), max(view.shape[1] for view in views)
    rows = []
    for start in range(0, len(views), columns):
        row = np.full((height, columns * width, 3), 32, dtype=np.uint8)
        for k, view in enumerate(views[start : start + columns]):
            row[: view.shape[0], k * width : k * width + view.shape[1]] = view
        rows.append(row)
    return np.vstack(rows)


def drawn(viewer: Viewer, frame: Frame, mask: Image | None, posed: Posed | None) -> Image:
    """One view with caption: dimmed image, contour of the silhouette, parts of the model, scores."""
    scale = LONG_SIDE_PX / max(viewer.camera.size)
    width, height = (2 * round(scale * side / 2) for side in viewer.camera.size)  # even, as video codecs need it
    size = (width, height)
    image = np.asarray(cv2.resize(frame.image, size, interpolation=cv2.INTER_CUBIC) * DIMMED, dtype=np.uint8)
    if mask is not None:
        large = cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
        contours, _ = cv2.findContours(large, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, contours, -1, CONTOUR, 1)
    text = f"viewer {viewer.id}   {'initial ' if frame.initial else ''}frame {frame.frame}"
    if posed is not None:
        if not is_lost(posed.message):
            draw_model(image, viewer.camera.resized(size), posed)
        view, score = views_of(posed.message).get(viewer.id, NO_VIEW)
        text += f"   {view}" + ("" if np.isnan(score) else f"   score {score:.2f}")
        lost = ", ".join(posed.lost)
        text += f"   lost: {lost}" if lost else ""
    caption = np.full((CAPTION_PX, size[0], 3), 32, dtype=np.uint8)
    cv2.putText(caption, text, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (235, 235, 235), 1, cv2.LINE_AA)
    return np.vstack([image, caption])


def draw_model(image: Image, camera: Camera, posed: Posed) -> None:
    """Outline every part as `camera` sees it, tilt and lens included: left limbs orange, right ones blue."""
    for part, corners in part_outlines(posed.anatomy, posed.body, posed.pose, camera):
        colour = LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE
        cv2.polylines(image, [np.round(corners * 16).astype(np.int32)], True, colour, 2, cv2.LINE_AA, 4)
