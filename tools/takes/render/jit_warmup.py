"""Compilation of the drawing functions ahead of their use.

Compiled by numba with a cache on disk, each for one signature: `rasterizer.fill`, `rasterizer.light_body` (with `lit` and
`shadow_at`), `rasterizer.develop`, `floor.draw_floor` and `floor.darken_floor` (with `between`).  Only `zenocap
render` needs them: the live page draws in the browser.  They compile at the first picture, or here in `zenocap warmup`.
"""

import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp, neutral_pose
from zenocap.common.body.kinematics import part_frames
from zenocap.tools.takes.render.camera_path import framing_camera
from zenocap.tools.takes.render.scene import Ground, Scene, sun_of
from zenocap.tools.takes.render.surfaces import body_surface, posed_surface
from zenocap.tools.takes.render.theme import THEMES

SIZE = (64, 48)


def load_compiled(bdp: Bdp) -> Image:
    """Draw one small picture of a ten-part body, (h, w, 3), which loads or compiles every drawing function."""
    frames = part_frames(TEN_PARTS, bdp, neutral_pose(TEN_PARTS, np.array([0.0, 0.95, 0.0])))
    surface = posed_surface(body_surface(TEN_PARTS, bdp), frames)
    camera = framing_camera(0.0, 0.1, surface.points, SIZE)
    return Scene(camera, Ground(np.zeros(2), 4.0), next(iter(THEMES.values())), sun_of(0.0)).picture(surface)
