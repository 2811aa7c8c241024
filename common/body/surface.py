"""The parts' surfaces as points."""

import numpy as np

from common.body.anatomy import Floats


def end_ellipses(part_to_world: Floats, size: Floats, count: int = 24) -> Floats:
    """(2 count, 3) points in the world on both end ellipses of an elliptic cylinder, metres; their hull is the part.

    part_to_world: (3, 4).  size: (3,) height, long and short radius, metres.
    """
    turn = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([size[1] * np.cos(turn), np.zeros(count), size[2] * np.sin(turn)], axis=1)
    local = np.concatenate([ring, ring + np.array([0.0, size[0], 0.0])])
    points: Floats = local @ part_to_world[:, :3].T + part_to_world[:, 3]
    return points
