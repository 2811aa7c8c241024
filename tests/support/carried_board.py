"""A board carried through the room: poses, corners, pictures.

The board itself is given by its picture and its corners.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image
from zenocap.common.camera.pinhole import Camera


@dataclass(frozen=True)
class BoardMotion:
    """A smooth motion through the room in which the board turns towards one camera after another.

    cameras: that it is shown to, in turn.  low, high: corners of the room's box (3,), m.  tilt: standard deviation of the
    angle between board and view, radians.
    """

    cameras: tuple[Camera, ...]
    low: Floats
    high: Floats
    tilt: float
    seed: int
    key_s: float = 0.7  # from one drawn pose to the next
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the board, in its frame

    def pose(self, time_s: float) -> tuple[Floats, Floats]:
        """Rotation (3, 3) and translation (3,), board to world."""
        key, part = divmod(time_s / self.key_s, 1.0)
        part = part * part * (3.0 - 2.0 * part)
        (one, place), (other, next_place) = self._key(int(key)), self._key(int(key) + 1)
        turn = np.asarray(cv2.Rodrigues(other @ one.T)[0]).ravel()
        rotation = np.asarray(cv2.Rodrigues(part * turn)[0]) @ one
        middle = (1.0 - part) * place + part * next_place
        return rotation, middle - rotation @ np.array(self.centre)

    def _key(self, number: int) -> tuple[Floats, Floats]:
        rng = np.random.default_rng((self.seed, 1000 + number))
        place = rng.uniform(self.low, self.high)
        one = self.cameras[rng.integers(len(self.cameras))]
        other = self.cameras[rng.integers(len(self.cameras))]
        ahead = place - 0.5 * (one.centre + other.centre)  # into the paper: away from the cameras
        ahead /= np.linalg.norm(ahead)
        down = np.array([0.0, -1.0, 0.0])
        right = np.cross(down, ahead)
        right /= np.linalg.norm(right)
        upright = np.stack([right, np.cross(ahead, right), ahead], axis=1)
        tilt = np.asarray(cv2.Rodrigues(rng.normal(0.0, self.tilt, 3))[0])
        return upright @ tilt, place


def seen_corners(camera: Camera, corners: Floats, pose: tuple[Floats, Floats]) -> tuple[Floats, np.ndarray]:
    """Pixels (n, 2) in the images as they are, and which of them are inside the image and seen from the front."""
    rotation, shift = pose
    world = corners @ rotation.T + shift
    if camera.fisheye is not None:
        pixels = camera.fisheye.project(world @ camera.rotation.T + camera.translation)
    else:
        pixels = camera.project(world)
    facing = (world.mean(axis=0) - camera.centre) @ rotation[:, 2] > 0.25 * np.linalg.norm(
        world.mean(axis=0) - camera.centre
    )
    inside = np.isfinite(pixels).all(axis=1) & (pixels > 2).all(axis=1) & (pixels < np.array(camera.size) - 3).all(axis=1)
    return pixels, inside & facing


def board_image(
    camera: Camera, picture: Image, side_m: Sequence[float], pose: tuple[Floats, Floats], seed: int = 0
) -> Image:
    """Grey image of a board before a plain wall, with noise.

    picture: of the board, with side_m (width, height) m.  Drawn through every pixel's ray: lens distortion is exact.
    """
    width, height = camera.size
    rays = _rays(camera.size, camera.matrix.tobytes(), camera.distortions.tobytes())
    rotation, shift = camera.rotation @ pose[0], camera.rotation @ pose[1] + camera.translation
    # The plane of the board: (x, y, z) = R (a, b, 0) + t, so that (a, b) follows from a ray by a homography.
    homography = np.linalg.inv(np.stack([rotation[:, 0], rotation[:, 1], shift], axis=1))
    scale = np.array(picture.shape[1::-1]) / np.array(side_m)
    places = cv2.perspectiveTransform(rays, homography)[:, 0] * scale - 0.5
    places[rays[:, 0, 0] * homography[2, 0] + rays[:, 0, 1] * homography[2, 1] + homography[2, 2] <= 0] = -1.0
    maps = places.astype(np.float32).reshape(height, width, 2).transpose(2, 0, 1).copy()
    drawn = cv2.remap(picture, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=190)
    noise = np.random.default_rng(seed).normal(0.0, 3.0, drawn.shape)
    soft = cv2.GaussianBlur(drawn.astype(np.float32), (0, 0), 0.7)
    return np.asarray(np.clip(soft + noise, 0, 255), dtype=np.uint8)


@lru_cache(maxsize=4)
def _rays(size: tuple[int, int], matrix: bytes, distortions: bytes) -> Floats:
    """(height * width, 1, 2) at depth 1 of all pixels."""
    pixels = np.stack(np.meshgrid(*(np.arange(count, dtype=np.float64) for count in size)), axis=-1).reshape(-1, 1, 2)
    return np.asarray(cv2.undistortPoints(pixels, np.frombuffer(matrix).reshape(3, 3), np.frombuffer(distortions)))
