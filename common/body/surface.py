"""The parts' surfaces as points."""

import numpy as np

from common.body.anatomy import Floats
from common.body.definition import Bdp

UPRIGHT = np.zeros(3)


def end_ellipses(
    part_to_world: Floats, size: Floats, count: int = 24, *, tip: Floats | None = None, base: Floats = UPRIGHT
) -> Floats:
    """(2 count, 3) points in the world on both ends of an elliptic cylinder or cone, metres; their hull is the part.

    part_to_world: (3, 4).  size: (3,) height, long and short radius, metres.  tip: (2,) radii at the far end, metres;
    None: those of the near one.  base: (3,) where the axis begins in the part's frame, metres.
    """
    turn = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(turn), np.zeros(count), np.sin(turn)], axis=1)
    across, deep = size[1:] if tip is None else tip
    near, far = ring * [size[1], 1.0, size[2]], ring * [across, 1.0, deep] + [0.0, size[0], 0.0]
    points: Floats = (np.concatenate([near, far]) + base) @ part_to_world[:, :3].T + part_to_world[:, 3]
    return points


def body_ellipses(bdp: Bdp, part_frames: Floats) -> list[Floats]:
    """`end_ellipses` of every part; part_frames: (parts, 3, 4), as `part_frames` gives them."""
    return [
        end_ellipses(
            frame,
            bdp.sizes[k],
            tip=None if bdp.tips is None else bdp.tips[k],
            base=UPRIGHT if bdp.bases is None else bdp.bases[k],
        )
        for k, frame in enumerate(part_frames)
    ]
