"""Loading, or the first time compiling, what a picture needs, before one is wanted."""

import numpy as np

from common.body.anatomy import TEN_PARTS
from common.body.definition import Bdp, neutral_pose
from common.body.kinematics import part_frames
from services.animator.render.look import LOOKS
from services.animator.render.scene import Ground, Image, Stage, sun_of
from services.animator.render.solids import posed, solids
from services.animator.render.viewpoint import looking

SIZE = (64, 48)


def load_compiled(bdp: Bdp) -> Image:
    """One small picture of a body of ten parts, (h, w, 3)."""
    frames = part_frames(TEN_PARTS, bdp, neutral_pose(TEN_PARTS, np.array([0.0, 0.95, 0.0])))
    surface = posed(solids(TEN_PARTS, bdp), frames, set())
    stage = Stage(
        looking(0.0, 0.1, surface.points, SIZE), Ground(np.zeros(2), 4.0), next(iter(LOOKS.values())), sun_of(0.0)
    )
    return stage.picture(surface)
