"""The whole body model in one view: its cover image, and the searches of torso and position that move it.  [Two-view 3.2]"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from common.body.limbs import limb_origins, limb_sizes
from common.camera.pinhole import Camera
from common.vision.model_image import ADD, COUNT, REMOVE, cover_part, score_of
from services.viewer.limb_search import LimbBody, Picture, cover_limb

Mask = NDArray[np.uint8]
SHIFTS_PX = (0, -1, 1, -2, 2, -5, 5)  # [Two-view 3.2], with the 0 it lacks; at the paper's 120 rows
ROWS = 120


def camera_rows(camera: Camera) -> Floats:
    """(5, 3) of a level camera for compiled code: rotation rows, translation, (focal, centre x, centre y) px."""
    k = camera.matrix
    return np.vstack([camera.rotation, camera.translation, [k[0, 0], k[0, 2], k[1, 2]]])


def torso_rotation(yaw: float, lean: float, roll: float) -> Floats:
    """M_W^N = Ry(yaw) Rx(lean) Rz(roll): the torso's frame to the world, (3, 3).  [Two-view 2.2 (1)]"""
    cy, sy, cx, sx, cz, sz = np.cos(yaw), np.sin(yaw), np.cos(lean), np.sin(lean), np.cos(roll), np.sin(roll)
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rotation: Floats = ry @ rx @ rz
    return rotation


@dataclass(frozen=True)
class BodyModel:
    """The sizes of one person as the searches need them, all in metres.

    torso, head: (3,) height, long and short radius.  neck: (3,) and origins: (4, 3) in the torso's frame.
    limbs: (4, 2, 3) heights and radii.
    """

    torso: Floats
    head: Floats
    neck: Floats
    origins: Floats
    limbs: Floats


def body_model(anatomy: Anatomy, bdp: Bdp) -> BodyModel:
    torso, head = anatomy.index["torso"], anatomy.index["head"]
    return BodyModel(
        bdp.sizes[torso], bdp.sizes[head], bdp.offsets[head], limb_origins(anatomy, bdp), limb_sizes(anatomy, bdp)
    )


@njit(cache=True, error_model="numpy")
def cover_core(
    position: Floats, torso_to_world: Floats, torso: Floats, head: Floats, neck: Floats, picture: Picture, mode: int,
    totals: NDArray[np.int64],
) -> None:  # fmt: skip
    """Add, remove or count torso and head; see `BodyModel` and `Picture`."""
    frame = np.empty((3, 4))
    frame[:, :3] = torso_to_world
    frame[:, 3] = position
    top = np.empty((3, 4))
    top[:, :3] = torso_to_world
    for row in range(3):
        top[row, 3] = position[row]
        for k in range(3):
            top[row, 3] += torso_to_world[row, k] * neck[k]
    if mode == COUNT:
        cover_part(frame, torso, picture.camera, picture.mask, picture.cover, ADD, totals)
        cover_part(top, head, picture.camera, picture.mask, picture.cover, COUNT, totals)
        model, both = totals[1], totals[2]
        cover_part(frame, torso, picture.camera, picture.mask, picture.cover, REMOVE, totals)
        totals[1], totals[2] = model, both
    else:
        cover_part(frame, torso, picture.camera, picture.mask, picture.cover, mode, totals)
        cover_part(top, head, picture.camera, picture.mask, picture.cover, mode, totals)


@njit(cache=True, error_model="numpy")
def core_score(
    position: Floats, torso_to_world: Floats, torso: Floats, head: Floats, neck: Floats, picture: Picture
) -> float:
    """Matching score with torso and head placed; the cover holds the limbs only."""
    counted = picture.totals.copy()
    cover_core(position, torso_to_world, torso, head, neck, picture, COUNT, counted)
    return score_of(counted[0], counted[1], counted[2])


class BodyFit:
    """The cover image of the whole model over one silhouette.  Mutable, made for one frame and thrown away.

    position: (3,) navel, metres.  torso_to_world: (3, 3).  directions: (4, 2, 3) limbs in the torso's frame.
    """

    def __init__(self, model: BodyModel, camera: Floats, mask: Mask) -> None:
        self.model = model
        self.camera = camera
        self.mask = mask
        self.expected = np.zeros((4, 2, 3))
        self.cover = np.zeros_like(mask)
        self.totals = np.array([int(np.count_nonzero(mask)), 0, 0], dtype=np.int64)

    def place(self, position: Floats, torso_to_world: Floats, directions: Floats) -> None:
        """Put the whole model down afresh."""
        self.position, self.torso_to_world, self.directions = position, torso_to_world, directions.copy()
        self.cover[:] = 0
        self.totals[1:] = 0
        self.picture = Picture(torso_to_world, self.camera, self.mask, self.cover, self.totals)
        self.core(ADD)
        for k in range(len(directions)):
            self.limb(k, ADD)

    def core(self, mode: int) -> None:
        m = self.model
        cover_core(self.position, self.torso_to_world, m.torso, m.head, m.neck, self.picture, mode, self.totals)

    def limb_body(self, k: int) -> LimbBody:
        origin = self.position + self.torso_to_world @ self.model.origins[k]
        return LimbBody(origin, self.model.limbs[k], k >= 2, self.expected[k])

    def limb(self, k: int, mode: int) -> None:
        cover_limb(self.directions[k], self.limb_body(k), self.picture, mode, self.totals)

    def score(self) -> float:
        """Matching score of the whole model.  [Two-view Eq. 1]"""
        return score_of(self.totals[0], self.totals[1], self.totals[2])

    def core_score(self, position: Floats, torso_to_world: Floats) -> float:
        m = self.model
        return core_score(position, torso_to_world, m.torso, m.head, m.neck, self.picture)

    def metres_per_pixel(self) -> float:
        depth = float(self.camera[2] @ self.position + self.camera[3, 2])
        return depth / float(self.camera[4, 0])

    def right(self) -> Floats:
        """The image's x axis in the world, (3,)."""
        return self.camera[0]
