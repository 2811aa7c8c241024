"""The whole body model over one silhouette: its cover image, placed, moved and scored.  [Two-view 2.3, 3.2]"""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from common.body.limbs import limb_origins, limb_sizes
from common.camera.pinhole import Camera
from common.vision.model_image import ADD, COUNT, cover_pair, score_of
from services.viewer.limb_search import LimbBody, Picture, cover_limb

Mask = NDArray[np.uint8]
Ints = NDArray[np.int64]

MARGIN = 0.35  # of the person's height
WHOLE, ARMLESS = 0, 2  # the first limb that is put down


class BodyModel(NamedTuple):
    """The sizes of one person, metres.  torso, head: (3,) height, long and short radius.  neck: (3,) and origins: (4, 3)
    joints in the torso's frame.  limbs: (4, 2, 3) heights and radii."""

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


def camera_rows(camera: Camera) -> Floats:
    """(5, 3) of a level camera for compiled code: rotation rows, translation, (focal, centre x, centre y) px."""
    k = camera.matrix
    return np.vstack([camera.rotation, camera.translation, [k[0, 0], k[0, 2], k[1, 2]]])


def around(camera: Floats, mask: Mask) -> tuple[Floats, Mask]:
    """The part of the picture around the silhouette, where a body model can match: less to clear and to draw.

    camera: (5, 3) rows.  mask: not empty.  MARGIN of the person's height is left on all sides.
    """
    left, top, width, height = cv2.boundingRect(mask)
    margin = max(8, round(MARGIN * height))
    x, y = max(0, left - margin), max(0, top - margin)
    part = np.ascontiguousarray(mask[y : top + height + margin, x : left + width + margin])
    moved = camera.copy()
    moved[4, 1] -= x
    moved[4, 2] -= y
    return moved, part


@njit(cache=True, error_model="numpy")
def cover_core(
    position: Floats, torso_to_world: Floats, model: BodyModel, picture: Picture, mode: int, totals: Ints
) -> None:
    """Add, remove or count torso and head; changes cover and totals."""
    frames = np.empty((2, 3, 4))
    sizes = np.empty((2, 3))
    for row in range(3):
        frames[0, row, 3] = frames[1, row, 3] = position[row]
        sizes[0, row], sizes[1, row] = model.torso[row], model.head[row]
        for k in range(3):
            frames[0, row, k] = frames[1, row, k] = torso_to_world[row, k]
            frames[1, row, 3] += torso_to_world[row, k] * model.neck[k]
    cover_pair(frames, sizes, picture.camera, picture.mask, picture.cover, mode, totals)


@njit(cache=True, error_model="numpy")
def core_score(position: Floats, torso_to_world: Floats, model: BodyModel, picture: Picture) -> float:
    """Matching score with torso and head placed so; the cover holds the limbs only and is left as it was."""
    counted = picture.totals.copy()
    cover_core(position, torso_to_world, model, picture, COUNT, counted)
    return score_of(counted[0], counted[1], counted[2])


@njit(cache=True, error_model="numpy")
def cover_body(
    position: Floats, torso_to_world: Floats, directions: Floats, model: BodyModel, picture: Picture, first: int
) -> float:
    """Put the model down afresh, with the limbs from `first` on, and return its matching score.

    directions: (4, 2, 3) in the torso's frame.  first: 0 for the whole model, 2 for the one without arms.
    """
    picture.cover[:, :] = 0
    picture.totals[1] = 0
    picture.totals[2] = 0
    cover_core(position, torso_to_world, model, picture, ADD, picture.totals)
    placed = Picture(torso_to_world, picture.camera, picture.mask, picture.cover, picture.totals)
    for k in range(first, 4):
        origin = position.copy()
        for row in range(3):
            for column in range(3):
                origin[row] += torso_to_world[row, column] * model.origins[k, column]
        limb = LimbBody(origin, model.limbs[k], k >= 2, directions[k])
        cover_limb(directions[k], limb, placed, ADD, picture.totals)
    return score_of(picture.totals[0], picture.totals[1], picture.totals[2])


class BodyFit:
    """The cover image of the whole model over one silhouette.  Mutable, made for one frame and thrown away.

    position: (3,) navel, metres.  torso_to_world: (3, 3).  directions: (4, 2, 3) limbs in the torso's frame.
    expected: (4, 2, 3) see `LimbBody`.  view_axis: (3,) unit vector from the camera to the navel, in the torso's frame.
    image_rows: height of the whole image, of which `mask` may be a part.
    """

    def __init__(self, model: BodyModel, camera: Floats, mask: Mask, image_rows: int = 0) -> None:
        self.image_rows = image_rows or mask.shape[0]
        totals = np.array([int(np.count_nonzero(mask)), 0, 0], dtype=np.int64)
        self.model = model
        self.picture = Picture(np.eye(3), camera, mask, np.zeros_like(mask), totals)
        self.position, self.torso_to_world = np.zeros(3), np.eye(3)
        self.view_axis = np.zeros(3)
        self.directions = np.zeros((4, 2, 3))
        self.expected = np.zeros((4, 2, 3))
        self.limb_areas = (2 * model.limbs[:, :, 0] * model.limbs[:, :, 1]).sum(axis=1)  # (4,) square metres

    def place(self, position: Floats, torso_to_world: Floats, directions: Floats) -> float:
        """Put the whole model down afresh; its matching score.  [Two-view Eq. 1]"""
        self.position, self.torso_to_world, self.directions = position, torso_to_world, directions.copy()
        self.picture = self.picture._replace(torso_to_world=torso_to_world)
        self.view_axis = self._axis()
        return cover_body(position, torso_to_world, directions, self.model, self.picture, WHOLE)

    def core(self, mode: int) -> None:
        cover_core(self.position, self.torso_to_world, self.model, self.picture, mode, self.picture.totals)

    def limb_body(self, k: int) -> LimbBody:
        origin = self.position + self.torso_to_world @ self.model.origins[k]
        return LimbBody(origin, self.model.limbs[k], k >= 2, self.expected[k])

    def limb(self, k: int, mode: int) -> None:
        cover_limb(self.directions[k], self.limb_body(k), self.picture, mode, self.picture.totals)

    def score(self) -> float:
        """Matching score of the whole model.  [Two-view Eq. 1]"""
        silhouette, model, both = self.picture.totals
        return score_of(silhouette, model, both)

    def metres_per_pixel(self) -> float:
        return self.depth() / float(self.picture.camera[4, 0])

    def depth(self) -> float:
        """Of the navel along the camera's axis, metres."""
        camera = self.picture.camera
        return float(camera[2] @ self.position + camera[3, 2])

    def _axis(self) -> Floats:
        camera = self.picture.camera
        ray = self.torso_to_world.T @ (self.position + camera[:3].T @ camera[3])  # the camera's centre is -R^T t
        axis: Floats = ray / np.sqrt(ray @ ray)
        return axis
