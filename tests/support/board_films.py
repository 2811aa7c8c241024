"""Pictures of a board at rest, and videos of one that is carried about."""

from collections.abc import Callable
from pathlib import Path

import cv2

from tests.support.board_views import floor_pose, room
from tests.support.carried_board import BoardMotion, board_image
from tests.support.video_file import write_video
from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.setup.calibration.board import Board, checked_board

FILM_BOARD = checked_board("charuco", 5, 7, 200.0)
SIZE, VIDEO_SIZE = (960, 540), (640, 360)
VIDEO_S, FPS = 7.0, 10


def board_pictures(folder: Path, count: int = 16, board: Board = FILM_BOARD, seed: int = 0) -> tuple[Camera, ...]:
    """Write pictures 00.png, 01.png ... of two cameras; in the last the board lies on the floor.  Returns the cameras."""
    cameras = room(2, seed, SIZE)
    image_at = board_images(cameras, board, seed, key_s=1.0)
    for camera in cameras:
        (folder / camera.name).mkdir(parents=True)
        for number in range(count):
            time_s = None if number == count - 1 else float(number)
            cv2.imwrite(str(folder / camera.name / f"{number:02d}.png"), image_at(camera, time_s, number))
    return cameras


def board_videos(folder: Path) -> tuple[Camera, ...]:
    """Write videos/cam01.mp4 and cam02.mp4; in the last two seconds the board lies on the floor.  Returns the cameras."""
    cameras = room(2, 0, VIDEO_SIZE)
    image_at = board_images(cameras, FILM_BOARD, 0, key_s=0.7)
    for camera in cameras:
        times = [None if number / FPS >= VIDEO_S - 2.0 else number / FPS for number in range(round(VIDEO_S * FPS))]
        images = [cv2.cvtColor(image_at(camera, time_s, k), cv2.COLOR_GRAY2BGR) for k, time_s in enumerate(times)]
        write_video(folder / "videos" / f"{camera.name}.mp4", images, fps=FPS)
    return cameras


def board_images(
    cameras: tuple[Camera, ...], board: Board, seed: int, key_s: float
) -> Callable[[Camera, float | None, int], Image]:
    """Function of camera, time (s; None: the board lies on the floor) and number of the image: its grey image."""
    picture = cv2.copyMakeBorder(board.picture(40), 20, 20, 20, 20, cv2.BORDER_CONSTANT, value=255)
    edge = 0.5 * board.square_m
    side_m = board.extent[0] * board.square_m + 2 * edge, board.extent[1] * board.square_m + 2 * edge
    margin = edge + board.spacing * board.square_m
    low, high = (-0.7, 0.6, -0.7), (0.7, 1.6, 0.7)
    motion = BoardMotion(cameras, low, high, 0.5, seed, key_s=key_s, centre=tuple(board.middle.tolist()))

    def image_at(camera: Camera, time_s: float | None, number: int) -> Image:
        rotation, shift = floor_pose(board) if time_s is None else motion.pose(time_s)
        corner = rotation @ [-margin, -margin, 0.0] + shift  # of the picture, which has a margin
        return board_image(camera, picture, side_m, (rotation, corner), number)

    return image_at
