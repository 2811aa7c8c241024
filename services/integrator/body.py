"""The BDP integrator: the two viewers' partial BDPs become the universal one.  [Two-view 2.4, 4.2]"""

from collections.abc import Mapping, Sequence

import numpy as np

from common.body.anatomy import Anatomy
from common.body.definition import Bdp
from common.body.proportions import body_from_lengths


def height_ratio(front: Mapping[str, float], side: Mapping[str, float]) -> float:
    """r_t = t2 / t1: the side viewer's height of the person over the front viewer's.  [Two-view 4.2]"""
    return side["height"] / front["height"]


def integrate_bodies(
    anatomy: Anatomy, fronts: Sequence[Mapping[str, float]], sides: Sequence[Mapping[str, float]]
) -> tuple[Bdp, float]:
    """The universal BDP and r_t, in the front viewer's scale: SR_torso,u = SR_torso,2 / r_t.

    fronts, sides: each viewer's lengths in metres over the same frames; their medians count.  Raises ValueError for a body
    no person has.
    """
    front, side = _medians(fronts), _medians(sides)
    ratio = height_ratio(front, side)
    return body_from_lengths(anatomy, front | {name: side[name] / ratio for name in ("torso_depth", "head_depth")}), ratio


def _medians(frames: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {name: float(np.median([frame[name] for frame in frames])) for name in frames[0]}
