"""Camera path of a picture or film: fixed, following the person, or turning."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from zenocap.common.arrays import Floats
from zenocap.common.body.inverse_kinematics import interpolated
from zenocap.common.camera.pinhole import Camera
from zenocap.services.animator import parameters
from zenocap.tools.takes.render.scene import Ground, sun_of

FIELD_OF_VIEW = np.radians(parameters.FIELD_OF_VIEW_DEG)

# Azimuth from +Z towards +X (the left of a person facing +Z), and elevation, degrees.
VIEWS: Mapping[str, tuple[float, float]] = {
    "front": (0.0, 9.0), "left": (90.0, 9.0), "back": (180.0, 9.0), "right": (270.0, 9.0), "quarter": (35.0, 14.0),
    "top": (0.0, 89.0),
}  # fmt: skip


@dataclass(frozen=True)
class Shot:
    """Viewpoint options.  view: one of VIEWS, or the id of a viewer.  follows: moves with the person.

    turning: radians per second around the scene, counter-clockwise seen from above.
    """

    view: str = "quarter"
    follows: bool = False
    turning: float = 0.0


@dataclass(frozen=True)
class CameraPath:
    """Cameras of a film by row.

    first: camera of row 0.  moves: (n, 3) metres from there by row.  turns: (n,) radians around `centre` (3,).
    """

    first: Camera
    ground: Ground
    sun: Floats
    centre: Floats
    moves: Floats
    turns: Floats

    @property
    def moving(self) -> bool:
        """Whether rows have different cameras."""
        return bool(self.moves.any() or self.turns.any())

    def at(self, row: int) -> tuple[Camera, Ground, Floats]:
        """Return camera, lit floor and direction to the sun of a row."""
        camera = moved_camera(turned_camera(self.first, self.centre, float(self.turns[row])), self.moves[row])
        ground = Ground(self.ground.middle + self.moves[row][[0, 2]], self.ground.radius)
        return camera, ground, self.sun


def camera_path(
    centres: Floats, times_s: Floats, shot: Shot, size: tuple[int, int], viewers: Mapping[str, Camera]
) -> CameraPath:
    """Return the path over n rows that keeps every pose in the picture.  Raises ValueError for an unknown view.

    centres: (n, markers, 3) joint centres, metres, NaN while the person is lost, not in all rows.  times_s: (n,).
    viewers: cameras of the rig by id.
    """
    ground_path = _ground_path(centres, times_s)
    moves = ground_path - ground_path[0] if shot.follows else np.zeros_like(ground_path)
    turns = shot.turning * (times_s - times_s[0])
    known = (centres - moves[:, None]).reshape(-1, 3)
    known = known[np.isfinite(known).all(axis=1)]
    around = np.concatenate([known + parameters.BODY_MARGIN_M * side for side in np.concatenate([np.eye(3), -np.eye(3)])])
    points = np.concatenate([around, known * [1.0, 0.0, 1.0]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    ground = Ground(
        middle[[0, 2]], max(parameters.LIT_RADIUS * float(np.hypot(*(high - low)[[0, 2]])), parameters.MIN_LIT_RADIUS_M)
    )
    if shot.view in VIEWS:
        azimuth, elevation = np.radians(VIEWS[shot.view])
        camera = framing_camera(float(azimuth), float(elevation), points, size, turned=bool(shot.turning))
    elif shot.view in viewers:
        camera = undistorted_camera(viewers[shot.view], size)
        away = camera.centre - middle
        azimuth = np.arctan2(away[0], away[2])
    else:
        others = f", or a viewer: {', '.join(sorted(viewers))}" if viewers else ""
        raise ValueError(f"view {shot.view!r}: allowed: {', '.join(VIEWS)}{others}")
    return CameraPath(camera, ground, sun_of(float(azimuth)), middle, moves, turns)


def _ground_path(centres: Floats, times_s: Floats) -> Floats:
    """Return the smoothed path of the person on the ground (n, 3), metres; interpolated while the person is lost."""
    path = interpolated(np.mean(centres, axis=1))
    path[:, 1] = 0.0
    step_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    if step_s > 0:
        path = gaussian_filter1d(path, parameters.FOLLOW_SMOOTHING_S / step_s, axis=0, mode="nearest")
    return path


def framing_camera(azimuth: float, elevation: float, points: Floats, size: tuple[int, int], turned: bool = False) -> Camera:
    """Return a camera at a distance at which all of `points` (n, 3), metres, are in its image.

    azimuth, elevation: of the camera seen from the points, radians, from +Z towards +X, and up.
    turned: the camera will turn around the points, which must fit from every side.
    """
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    back = np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
    up = np.cross(back, right)
    half = np.tan(FIELD_OF_VIEW / 2) * np.array(size) / min(size)  # tangents across and up
    away = points - target
    if turned:
        reach = np.hypot(away[:, 0], away[:, 2])
        turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        sides = zip(np.sin(turns).tolist(), np.cos(turns).tolist(), strict=True)
        away = np.concatenate([np.stack([reach * s, away[:, 1], reach * c], axis=1) for s, c in sides])
    wanted = np.abs(np.stack([away @ right, away @ up], axis=1)) / (parameters.FILL * half)
    distance = max(float(np.max(wanted.max(axis=1) + away @ back)), parameters.MIN_DISTANCE_M)
    rotation = np.stack([right, -up, -back])
    focal = min(size) / 2 / np.tan(FIELD_OF_VIEW / 2)
    matrix = np.array([[focal, 0.0, (size[0] - 1) / 2], [0.0, focal, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera("picture", size, matrix, np.zeros(4), rotation, -rotation @ (target + distance * back))


def undistorted_camera(camera: Camera, size: tuple[int, int]) -> Camera:
    """Return a camera of the rig without lens distortion and with another image size, which shows at least the same."""
    scale = min(size[0] / camera.size[0], size[1] / camera.size[1])
    focal = 0.5 * (camera.matrix[0, 0] + camera.matrix[1, 1]) * scale
    offset = (camera.matrix[:2, 2] - (np.array(camera.size) - 1) / 2) * scale
    centre = (np.array(size) - 1) / 2 + offset
    matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    return Camera(camera.name, size, matrix, np.zeros(4), camera.rotation, camera.translation)


def moved_camera(camera: Camera, by: Floats) -> Camera:
    """Return a camera moved by (3,) metres."""
    return replace(camera, translation=camera.translation - camera.rotation @ by)


def turned_camera(camera: Camera, centre: Floats, turn: float) -> Camera:
    """Return a camera turned about the vertical line through `centre` (3,), counter-clockwise seen from above, radians."""
    c, s = np.cos(turn), np.sin(turn)
    rotation_about = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    rotation = camera.rotation @ rotation_about.T
    position = centre + rotation_about @ (camera.centre - centre)
    return replace(camera, rotation=rotation, translation=-rotation @ position)
