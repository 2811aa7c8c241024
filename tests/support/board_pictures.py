"""Pictures of a board before one camera, with the true pixels of its corners."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tests.support.carried_board import board_image, seen_corners
from tests.support.video_file import write_video
from zenocap.common.arrays import Floats, Image
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.setup.calibration.board import Board

SQUARE_PX = 40  # of the drawn board


def plain_camera(size: tuple[int, int] = (640, 480), focal: float = 600.0, k1: float = -0.1) -> Camera:
    """A camera at the origin that looks along Z."""
    matrix = np.array([[focal, 0.0, size[0] / 2 - 3.0], [0.0, focal, size[1] / 2 + 2.0], [0.0, 0.0, 1.0]])
    return Camera("cam01", size, matrix, np.array([k1, 0.02, 0.0, 0.0, 0.0]), np.eye(3), np.zeros(3))


def before(board: Board, distance_m: float, turn: tuple[float, float, float] = (0, 0, 0), aside: tuple = (0, 0)):
    """Pose, board to camera: its middle at a distance, beside the axis, turned by a rotation vector in radians."""
    rotation = np.asarray(cv2.Rodrigues(np.array(turn, dtype=np.float64))[0])
    return rotation, np.array([*aside, distance_m]) - rotation @ board.middle


def picture_of(board: Board, camera: Camera, pose: tuple[Floats, Floats], seed: int = 0) -> Image:
    """The board with a white margin of one square, before a grey wall."""
    drawn = board.picture(SQUARE_PX)
    white = 0 if board.inverted else 255
    framed = cv2.GaussianBlur(np.pad(drawn, SQUARE_PX, constant_values=white), (0, 0), 1.0)  # else edges have steps
    sides = (np.array(board.extent) + 2) * board.square_m
    margin = (1 + board.spacing) * board.square_m
    rotation, shift = pose
    moved = rotation, shift - rotation @ np.array([margin, margin, 0.0])
    return board_image(camera, framed, sides, moved, seed)


def true_pixels(board: Board, camera: Camera, pose: tuple[Floats, Floats]) -> Floats:
    """Of all corners, (n, 2)."""
    return seen_corners(camera, board.corners, pose)[0]


def board_video(path: Path, pictures: Sequence[Image], fps: float) -> Path:
    """A video of grey pictures."""
    return write_video(path, [cv2.cvtColor(one, cv2.COLOR_GRAY2BGR) for one in pictures], fps=fps)


def picture_folder(folder: Path, pictures: Sequence[Image], names: Sequence[str] | None = None) -> Path:
    """A folder of pictures with names such as a.png, by default 000.png and so on."""
    folder.mkdir(parents=True)
    for name, one in zip(names or [f"{k:03d}.png" for k in range(len(pictures))], pictures, strict=True):
        cv2.imwrite(str(folder / name), one)
    return folder
