"""Pictures and a video of the model drawn on the person in every view, to see with one's own eyes how well it fits."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from common import messages as m
from common.body.anatomy import Anatomy
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.body.surface import body_ellipses
from common.camera.pinhole import Camera
from common.conversion import anatomy_of, bdp_of
from common.formats.poses import NO_PART, Bap, is_lost, parts_of, pose_of, searched_for
from common.runtime.rig import Rig, Viewer
from common.runtime.rig_file import RigError
from common.vision.packing import unpack
from services.takes.track import Instant
from services.viewer.sources.frame import Frame, Image

LONG_SIDE_PX = 640  # of each view in the picture
PER_ROW = 4
DIMMED = 0.55
CAPTION_PX = 26
CONTOUR = (255, 255, 255)
LEFT, RIGHT, MIDDLE = (60, 150, 255), (255, 190, 60), (110, 220, 110)  # orange, blue, green (BGR)


@dataclass(frozen=True)
class Posed:
    """What is drawn: the last body and pose, whoever found them."""

    anatomy: Anatomy
    bdp: Bdp
    pose: Pose
    bap: Bap


class Overlay:
    """folder: gets frame-NNNNNN.png for each `every`-th frame, and overlay.mp4 of all."""

    def __init__(self, rig: Rig, folder: Path, every: int) -> None:
        """Raises RigError when the folder cannot be written."""
        self._rig, self._folder, self._every = rig, folder, every
        self._body: tuple[Anatomy, Bdp] | None = None
        self._film: cv2.VideoWriter | None = None
        self._last: dict[str, Image] = {}
        self._pictures = self._seen = 0
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RigError(f"--overlay {folder}: cannot be made: {error.strerror or error}") from error

    def see(self, instant: Instant) -> None:
        """Draw one instant."""
        posed: Posed | None = None
        masks: dict[str, Image] = {}
        for message in instant.said:
            match message:
                case m.UniversalBdp(body=body) | m.TrackerBdp(body=body):
                    anatomy = anatomy_of(body)
                    self._body = anatomy, bdp_of(anatomy, body)
                case m.UniversalBap() | m.TrackerPose() as bap if self._body is not None:
                    anatomy, bdp = self._body
                    posed = Posed(anatomy, bdp, pose_of(anatomy, bap), bap)
                case m.Silhouette() as silhouette:
                    masks[silhouette.viewer] = unpack(silhouette.size, silhouette.region, silhouette.data)
        for viewer in self._rig.viewers:
            frame = instant.frames.get(viewer.id)
            if frame is not None:
                self._last[viewer.id] = drawn(viewer, frame, masks.get(viewer.id), posed)
        if len(self._last) < len(self._rig.viewers):
            return
        picture = side_by_side([self._last[viewer.id] for viewer in self._rig.viewers])
        first = next(iter(instant.frames.values()))
        if self._seen % self._every == 0:
            self._pictures += 1
            name = f"{'initial' if first.initial else 'frame'}-{first.frame:06d}.png"
            cv2.imwrite(str(self._folder / name), picture)
        self._seen += 1
        if self._film is None:
            size = (picture.shape[1], picture.shape[0])
            codec = cv2.VideoWriter.fourcc(*"mp4v")
            self._film = cv2.VideoWriter(str(self._folder / "overlay.mp4"), codec, self._rig.viewers[0].fps, size)
        self._film.write(picture)

    def finish(self) -> int:
        """Close the video; how many pictures were written."""
        if self._film is not None:
            self._film.release()
        return self._pictures


def side_by_side(views: Sequence[Image]) -> Image:
    """All views in rows of at most PER_ROW, what is left over is dark."""
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
    """One view and a caption: dimmed image, silhouette's contour, the model's parts, what is known."""
    scale = LONG_SIDE_PX / max(viewer.camera.size)
    width, height = (2 * round(scale * side / 2) for side in viewer.camera.size)  # even, as video codecs need it
    size = (width, height)
    image = np.asarray(cv2.resize(frame.image, size, interpolation=cv2.INTER_CUBIC) * DIMMED, dtype=np.uint8)
    if mask is not None:
        large = cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
        contours, _ = cv2.findContours(large, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, contours, -1, CONTOUR, 1)
    words = f"viewer {viewer.id}   {'initial ' if frame.initial else ''}frame {frame.frame}"
    if posed is not None:
        if not is_lost(posed.bap):
            draw_model(image, viewer.camera.resized(size), posed)
        view, score = parts_of(posed.bap).get(viewer.id, NO_PART)
        words += f"   {view}" + ("" if np.isnan(score) else f"   score {score:.2f}")
        searched = ", ".join(searched_for(posed.bap))
        words += f"   lost: {searched}" if searched else ""
    caption = np.full((CAPTION_PX, size[0], 3), 32, dtype=np.uint8)
    cv2.putText(caption, words, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (235, 235, 235), 1, cv2.LINE_AA)
    return np.vstack([image, caption])


def draw_model(image: Image, camera: Camera, posed: Posed) -> None:
    """Outline every part as `camera` sees it, tilt and lens included: left limbs orange, right ones blue."""
    outlines = body_ellipses(posed.bdp, part_frames(posed.anatomy, posed.bdp, posed.pose))
    for part, ellipses in zip(posed.anatomy.parts, outlines, strict=True):
        points = camera.project(ellipses)
        if not np.all(np.isfinite(points)) or np.abs(points).max() > 1e5:
            continue  # behind the camera, or all but in it
        hull = cv2.convexHull(points.astype(np.float32))
        colour = LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE
        cv2.polylines(image, [np.round(hull * 16).astype(np.int32)], True, colour, 2, cv2.LINE_AA, 4)
