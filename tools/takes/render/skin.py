"""The body surface as a skin of the skeleton, for exported scenes."""

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.formats.animated_skeleton import Skin
from zenocap.common.formats.skeleton import skeleton_of
from zenocap.tools.takes.render.surfaces import HEAD, LEFT, MIDDLE, RIGHT, VISOR, body_surface, posed_surface
from zenocap.tools.takes.render.theme import THEMES, linear

MATERIALS = {MIDDLE: "torso", LEFT: "left", RIGHT: "right", HEAD: "head", VISOR: "visor"}


def skin_of(anatomy: Anatomy, bdp: Bdp) -> Skin:
    """Return the surface in the skeleton's rest pose; the points of a part move with the first bone of that part."""
    skeleton = skeleton_of(anatomy, bdp)
    body = body_surface(anatomy, bdp)
    rest = part_frames(anatomy, bdp, Pose(np.zeros(3), t_pose_angles(anatomy)))
    surface = posed_surface(body, rest)
    first = {part: skeleton.parts.tolist().index(part) for part in set(skeleton.parts.tolist())}
    root = rest[skeleton.parts[0], :, 3]
    colours = np.array([linear(colour)[::-1] for colour in THEMES["light"].body])[list(MATERIALS)]
    return Skin(
        points=surface.points - root, normals=surface.normals, triangles=surface.triangles,
        bones=np.array([first[part] for part in body.parts.tolist()]),
        materials=np.array([list(MATERIALS).index(shade) for shade in surface.shades[surface.triangles[:, 0]].tolist()]),
        colours=colours, names=tuple(MATERIALS.values()),
    )  # fmt: skip
