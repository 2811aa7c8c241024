"""Pictures of a board at rest, a folder of images for each camera."""

from pathlib import Path

import cv2

from tests.support.board_views import floor_pose, room
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.board_film import BoardMotion, board_image
from zenocap.tools.calibration.board import Board, checked_board

FILM_BOARD = checked_board("charuco", 5, 7, 200.0)
SIZE = (960, 540)


def board_pictures(folder: Path, count: int = 16, board: Board = FILM_BOARD, seed: int = 0) -> tuple[Camera, ...]:
    """Write pictures 00.png, 01.png ... of two cameras; in the last the board lies on the floor.  Returns the cameras."""
    cameras = room(2, seed, SIZE)
    picture = cv2.copyMakeBorder(board.picture(40), 20, 20, 20, 20, cv2.BORDER_CONSTANT, value=255)
    edge = 0.5 * board.square_m
    side_m = board.extent[0] * board.square_m + 2 * edge, board.extent[1] * board.square_m + 2 * edge
    margin = edge + board.spacing * board.square_m
    low, high = (-0.7, 0.6, -0.7), (0.7, 1.6, 0.7)
    motion = BoardMotion(cameras, low, high, 0.5, seed, key_s=1.0, centre=tuple(board.middle.tolist()))
    for camera in cameras:
        (folder / camera.name).mkdir(parents=True)
        for number in range(count):
            rotation, shift = floor_pose(board) if number == count - 1 else motion.pose(float(number))
            corner = rotation @ [-margin, -margin, 0.0] + shift  # of the picture, which has a margin
            image = board_image(camera, picture, side_m, (rotation, corner), number)
            cv2.imwrite(str(folder / camera.name / f"{number:02d}.png"), image)
    return cameras
