"""Simulated rigs and what they see of a board."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.support.carried_board import BoardMotion, seen_corners
from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.setup.calibration.board import Board, checked_board
from zenocap.tools.setup.calibration.board_views import CameraViews, View, with_velocities
from zenocap.tools.setup.calibration.lens_model import LensModel
from zenocap.tools.setup.calibration.precision import aligned_errors, seen_pixels, triangulated
from zenocap.tools.setup.calibration.rig_start import Pose

BOARD = checked_board("charuco", 7, 9, 60.0)


def room(count: int, seed: int = 0, size: tuple[int, int] = (1280, 720), distortion: float = 1.0) -> tuple[Camera, ...]:
    """Cameras around a room, 3 to 4 m from its middle and 1.5 to 2.5 m high, with lenses drawn by the seed."""
    rng, cameras = np.random.default_rng(seed), []
    span = np.radians(min(300.0, 80.0 * (count - 1)))
    for number in range(count):
        heading = span * number / max(1, count - 1) + rng.normal(0, 0.1)
        distance, height = rng.uniform(3.0, 4.0), rng.uniform(1.5, 2.5)
        centre = np.array([distance * np.sin(heading), height, distance * np.cos(heading)])
        forward = np.array([0.0, 1.0, 0.0]) + rng.normal(0, 0.1, 3) - centre
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        focal = rng.uniform(0.6, 0.8) * size[0]
        middle = np.array(size) / 2 - 0.5 + rng.normal(0, 8, 2)
        matrix = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1.0]])
        terms = distortion * np.array([rng.uniform(-0.25, 0.1), rng.uniform(-0.05, 0.05), *rng.normal(0, 5e-4, 2), 0.0])
        cameras.append(Camera(f"cam{number + 1:02d}", size, matrix, terms, rotation, -rotation @ centre))
    return tuple(cameras)


def with_fisheye(camera: Camera, focal_share: float = 0.3) -> Camera:
    """The camera with a fisheye lens of about 160 degrees across."""
    width, height = camera.size
    matrix = np.array([[focal_share * width, 0, width / 2], [0, focal_share * width, height / 2], [0, 0, 1.0]])
    lens = FisheyeLens(camera.size, matrix, np.array([-0.01, 0.003, -0.001, 0.0]))
    return replace(camera, matrix=lens.pinhole_matrix(), distortions=np.zeros(4), fisheye=lens)


def board_views(
    cameras: tuple[Camera, ...], *, board: Board = BOARD, seconds: float = 40.0, fps: float = 10.0, noise_px: float = 0.2,
    delays_s: tuple[float, ...] = (), readouts_s: tuple[float, ...] = (), seed: int = 0, floor_s: float | None = None,
) -> tuple[list[CameraViews], BoardMotion]:  # fmt: skip
    """Views of a board that is carried about.  delays_s: by camera; a frame with time t shows the instant t + delay.

    readouts_s: by camera, from the first to the last row of an image, whose middle row is of that instant.

    floor_s: from then on the board lies on the floor, in the middle of the room.
    """
    motion = BoardMotion(
        cameras, np.array([-1.0, 0.5, -1.0]), np.array([1.0, 1.8, 1.0]), 0.45, seed, centre=tuple(board.middle.tolist())
    )
    rng, found = np.random.default_rng(seed + 1), []
    for number, camera in enumerate(cameras):
        delay_s = delays_s[number] if delays_s else 0.0
        readout_s = readouts_s[number] if readouts_s else 0.0
        views = []
        for frame in range(int(seconds * fps)):
            time_s = frame / fps
            lies = floor_s is not None and time_s >= floor_s
            shown_s = time_s + delay_s
            pixels, seen = seen_corners(camera, board.corners, floor_pose(board) if lies else motion.pose(shown_s))
            if readout_s and not lies:
                pixels = _rolled(camera, board, motion, shown_s, readout_s, pixels)
            pixels = pixels + noise_px * rng.standard_normal(pixels.shape)
            if seen.sum() >= 6:
                views.append(View(time_s, np.flatnonzero(seen), pixels[seen], np.full((int(seen.sum()), 2), np.nan)))
        known = with_velocities(views, 1.0 / fps)
        found.append(CameraViews(camera.name, camera.size, 1.0 / fps, int(seconds * fps), known))
    return found, motion


def _rolled(camera: Camera, board: Board, motion: BoardMotion, time_s: float, readout_s: float, pixels: Floats) -> Floats:
    """Pixels (n, 2) of corners whose rows are exposed one after the other; a parabola in time through three instants."""
    ends = [seen_corners(camera, board.corners, motion.pose(time_s + part * readout_s))[0] for part in (-0.5, 0.5)]
    slope, bend = ends[1] - ends[0], 2.0 * (ends[0] + ends[1] - 2.0 * pixels)
    rolled = pixels
    for _ in range(5):
        row = ((rolled[:, 1] + 0.5) / camera.size[1] - 0.5)[:, None]
        rolled = pixels + row * slope + row**2 * bend
    return rolled


def floor_pose(board: Board) -> Pose:
    """Board to world: flat on the floor, its upper side up, its rows along X."""
    rotation = np.stack([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]], axis=1)
    return rotation, -rotation @ board.middle


def rig_error_m(cameras: Sequence[Camera], true: Sequence[Camera], points: Floats) -> float:
    """Root mean square distance of points (n, 3) from where `cameras` put what `true` ones see, after the best motion."""
    pixels = seen_pixels(*_parts(true), points)
    measured = triangulated(*_parts(cameras), pixels)
    seen = np.isfinite(measured[:, 0])
    return float(np.sqrt((aligned_errors(measured[seen], points[seen]) ** 2).mean()))


def _parts(cameras: Sequence[Camera]) -> tuple[list[LensModel], list[Pose]]:
    return [LensModel.of(Lens.of(one)) for one in cameras], [(one.rotation, one.translation) for one in cameras]


def places(count: int = 60, seed: int = 5) -> Floats:
    """Places in the middle of the room, m."""
    return np.random.default_rng(seed).uniform([-0.8, 0.3, -0.8], [0.8, 1.8, 0.8], (count, 3))
