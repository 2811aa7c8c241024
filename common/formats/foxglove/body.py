"""The human model as a scene: every part an elliptic cylinder, or a cone where it is tapered.

A `foxglove.CylinderPrimitive` stands about its own Z, centred, in a box of its size; a part stands from its joint along
its own Y with the long radius along X and the short one along Z.  So the primitive's X, Y, Z are the part's X, -Z, Y.
A cone's radii both shrink alike towards its end: the mean of a part's two does.
"""

import foxglove.messages as fox
import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from common.body.limbs import limbs_of
from common.body.quaternions import quaternions
from common.formats.foxglove.channels import PERSON, WORLD
from common.formats.foxglove.frames import quaternion, vector

# Columns of a part's rotation, and their signs, that make a primitive's.
_COLUMNS, _SIGNS = [0, 2, 1], np.array([1.0, -1.0, 1.0])
LEFT = fox.Color(r=1.0, g=0.59, b=0.24, a=1.0)  # orange, as in the overlays of `zenocap track`
RIGHT = fox.Color(r=0.24, g=0.75, b=1.0, a=1.0)  # blue
MIDDLE = fox.Color(r=0.43, g=0.86, b=0.43, a=1.0)  # green
SEARCHED = fox.Color(r=0.5, g=0.5, b=0.5, a=1.0)  # a limb that is lost; see-through would make the whole body so
LIFETIME = fox.Duration(sec=1, nsec=0)  # when nothing follows, as after a crash of the integrator, the person goes


class Figure:
    """One person's cylinders, with all that does not change with the pose made once."""

    def __init__(self, anatomy: Anatomy, bdp: Bdp) -> None:
        self.bdp = bdp
        self._middles = bdp.sizes[:, :1] / 2 * [0.0, 1.0, 0.0]
        tops = np.ones(len(bdp.sizes))
        if bdp.bases is not None:
            self._middles = self._middles + bdp.bases
        if bdp.tips is not None:
            tops = np.mean(bdp.tips / bdp.sizes[:, 1:], axis=1)
        # The box is as wide as the wider end, of which a scale of 1 is.
        self._bottoms, self._tops = (np.minimum(scale, 1.0).tolist() for scale in (1.0 / tops, tops))
        widest = np.maximum(tops, 1.0)[:, None] * bdp.sizes[:, 1:]
        rows = np.column_stack([widest, bdp.sizes[:, 0]]).tolist()
        self._sizes = [vector(2 * across, 2 * deep, height) for across, deep, height in rows]
        self._colours = [_colour(part) for part in anatomy.parts]
        self._limbs = {limb.name: (limb.upper, limb.lower) for limb in limbs_of(anatomy)}

    def shown(self, part_to_world: Floats, lost: list[str], stamp: fox.Timestamp) -> fox.SceneUpdate:
        """part_to_world: (parts, 3, 4).  lost: limbs that are being searched for."""
        centres = part_to_world[:, :, 3] + np.einsum("pij,pj->pi", part_to_world[:, :, :3], self._middles)
        turns = quaternions(part_to_world[:, :, _COLUMNS] * _SIGNS)
        colours = self._colours.copy()
        for name in lost:
            for part in self._limbs.get(name, ()):
                colours[part] = SEARCHED
        cylinders = [
            fox.CylinderPrimitive(
                pose=fox.Pose(position=vector(*centre), orientation=quaternion(*turn)),
                size=size,
                bottom_scale=bottom,
                top_scale=top,
                color=colour,
            )
            for centre, turn, size, bottom, top, colour in zip(
                centres.tolist(), turns.tolist(), self._sizes, self._bottoms, self._tops, colours, strict=True
            )
        ]
        entity = fox.SceneEntity(timestamp=stamp, frame_id=WORLD, id=PERSON, lifetime=LIFETIME, cylinders=cylinders)
        return fox.SceneUpdate(entities=[entity])


def gone(stamp: fox.Timestamp) -> fox.SceneUpdate:
    """The person is lost: nothing to show."""
    return fox.SceneUpdate(deletions=[fox.SceneEntityDeletion(timestamp=stamp, id=PERSON)])


def _colour(part: str) -> fox.Color:
    return LEFT if part.startswith("left") else RIGHT if part.startswith("right") else MIDDLE
