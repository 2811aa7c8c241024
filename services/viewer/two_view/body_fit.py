"""Matching of the whole body model against one silhouette.  [Two-view 2.3, 3.2]"""

from typing import NamedTuple, cast

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.segments import limb_origins, limb_sizes
from zenocap.common.camera.pinhole import Camera
from zenocap.common.jit import kernel
from zenocap.common.vision.model_image import ADD, cover_pair, score_of_counts
from zenocap.services.viewer.parameters import CROP_MARGIN, CROP_MARGIN_MIN_PX
from zenocap.services.viewer.two_view.limb_search import CoverImage, LimbBody, cover_limb

# First limb that is drawn.  numpy integers: see `model_image`.
WHOLE, ARMLESS = cast(int, np.int64(0)), cast(int, np.int64(2))


class PersonSizes(NamedTuple):
    """Sizes of one person, metres.

    torso, head: (3,) height, long and short radius.  neck: (3,) and origins: (4, 3), shoulders and hips, in the torso's
    frame.  limbs: (4, 2, 3) heights and radii.
    """

    torso: Floats
    head: Floats
    neck: Floats
    origins: Floats
    limbs: Floats


def body_model(anatomy: Anatomy, bdp: Bdp) -> PersonSizes:
    """Sizes of a body as arrays for compiled functions."""
    torso, head = anatomy.index["torso"], anatomy.index["head"]
    return PersonSizes(
        bdp.sizes[torso], bdp.sizes[head], bdp.offsets[head], limb_origins(anatomy, bdp), limb_sizes(anatomy, bdp)
    )


def camera_rows(camera: Camera) -> Floats:
    """(5, 3) of a level camera for compiled functions: rotation, translation, (focal length, centre x, centre y) px."""
    k = camera.matrix
    return np.vstack([camera.rotation, camera.translation, [k[0, 0], k[0, 2], k[1, 2]]])


def cropped(camera: Floats, mask: Mask) -> tuple[Floats, Mask]:
    """Camera rows (5, 3) and mask of the image part around the silhouette: less to clear and to draw.

    camera: (5, 3) rows.  mask: not empty.  Keeps a margin of CROP_MARGIN body heights on all sides.
    """
    left, top, width, height = cv2.boundingRect(mask)
    margin = max(CROP_MARGIN_MIN_PX, round(CROP_MARGIN * height))
    x, y = max(0, left - margin), max(0, top - margin)
    part = np.ascontiguousarray(mask[y : top + height + margin, x : left + width + margin])
    moved = camera.copy()
    moved[4, 1] -= x
    moved[4, 2] -= y
    return moved, part


@kernel
def cover_body(
    position: Floats, torso_to_world: Floats, directions: Floats, model: PersonSizes, image: CoverImage, first: int
) -> float:
    """Clear the cover, draw the model with the limbs from `first` on, and return its matching score.

    position: (3,) navel, metres.  directions: (4, 2, 3) in the torso's frame.  first: WHOLE, or ARMLESS for no arms.
    """
    image.cover[:, :] = 0
    image.totals[1] = 0
    image.totals[2] = 0
    _cover_torso_and_head(position, torso_to_world, model, image)
    placed = CoverImage(torso_to_world, image.camera, image.mask, image.cover, image.totals)
    for k in range(first, 4):
        origin = position.copy()
        for row in range(3):
            for column in range(3):
                origin[row] += torso_to_world[row, column] * model.origins[k, column]
        limb = LimbBody(origin, model.limbs[k], k >= 2)
        cover_limb(directions[k], limb, placed, ADD, image.totals)
    return score_of_counts(image.totals[0], image.totals[1], image.totals[2])


@kernel
def _cover_torso_and_head(position: Floats, torso_to_world: Floats, model: PersonSizes, image: CoverImage) -> None:
    frames = np.empty((2, 3, 4))
    sizes = np.empty((2, 3))
    for row in range(3):
        frames[0, row, 3] = frames[1, row, 3] = position[row]
        sizes[0, row], sizes[1, row] = model.torso[row], model.head[row]
        for k in range(3):
            frames[0, row, k] = frames[1, row, k] = torso_to_world[row, k]
            frames[1, row, 3] += torso_to_world[row, k] * model.neck[k]
    cover_pair(frames, sizes, image.camera, image.mask, image.cover, ADD, image.totals)


class BodyFit:
    """The whole model drawn over one silhouette.  Mutable; made for one step and not kept in a state.

    position: (3,) navel, metres.  torso_to_world: (3, 3).  directions: (4, 2, 3) limbs in the torso's frame.
    view_axis: (3,) unit vector from the camera to the navel, in the torso's frame.
    image_rows: height of the whole image, of which `mask` may be a part.
    """

    def __init__(self, model: PersonSizes, camera: Floats, mask: Mask, image_rows: int = 0) -> None:
        self.image_rows = image_rows or mask.shape[0]
        totals: Ints = np.array([int(np.count_nonzero(mask)), 0, 0], dtype=np.int64)
        self.model = model
        self.image = CoverImage(np.eye(3), camera, mask, np.zeros_like(mask), totals)
        self.position, self.torso_to_world = np.zeros(3), np.eye(3)
        self.view_axis = np.zeros(3)
        self.directions = np.zeros((4, 2, 3))
        self.limb_areas = (2 * model.limbs[:, :, 0] * model.limbs[:, :, 1]).sum(axis=1)  # (4,) m², seen from the side

    def place(self, position: Floats, torso_to_world: Floats, directions: Floats) -> float:
        """Draw the whole model at a pose; returns its matching score.  [Two-view Eq. 1]"""
        self.position, self.torso_to_world, self.directions = position, torso_to_world, directions.copy()
        self.image = self.image._replace(torso_to_world=torso_to_world)
        self.view_axis = self._axis()
        return cover_body(position, torso_to_world, directions, self.model, self.image, WHOLE)

    def limb_body(self, k: int) -> LimbBody:
        """Geometry of limb k at the current pose."""
        origin = self.position + self.torso_to_world @ self.model.origins[k]
        return LimbBody(origin, self.model.limbs[k], k >= 2)

    def cover_limb(self, k: int, mode: int) -> None:
        """Add (ADD) or remove (REMOVE) limb k at its current directions."""
        cover_limb(self.directions[k], self.limb_body(k), self.image, mode, self.image.totals)

    def score(self) -> float:
        """Matching score of the whole model.  [Two-view Eq. 1]"""
        silhouette, model, both = self.image.totals
        return score_of_counts(silhouette, model, both)

    def metres_per_pixel(self) -> float:
        """Size of a pixel at the depth of the navel, metres."""
        return self.depth() / float(self.image.camera[4, 0])

    def depth(self) -> float:
        """Depth of the navel along the optical axis, metres."""
        camera = self.image.camera
        return float(camera[2] @ self.position + camera[3, 2])

    def _axis(self) -> Floats:
        camera = self.image.camera
        ray = self.torso_to_world.T @ (self.position + camera[:3].T @ camera[3])  # the camera centre is -R^T t
        axis: Floats = ray / np.sqrt(ray @ ray)
        return axis
