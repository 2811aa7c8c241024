"""Between messages, which name things, and arrays, which order them by an anatomy."""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from common.messages import Body


def body_of(anatomy: Anatomy, bdp: Bdp) -> Body:
    """The message's form of a body definition."""
    sizes = {part: _triple(bdp.sizes[k]) for k, part in enumerate(anatomy.parts)}
    offsets = {joint.name: _triple(bdp.offsets[k]) for k, joint in enumerate(anatomy.joints)}
    return Body(anatomy=anatomy.name, sizes=sizes, offsets=offsets)


def bdp_of(anatomy: Anatomy, body: Body) -> Bdp:
    """A message's body definition as arrays.  Raises ValueError when it is of another anatomy."""
    if body.anatomy != anatomy.name:
        raise ValueError(f"body: anatomy is {body.anatomy!r}; this service knows {anatomy.name!r}")
    missing = [part for part in anatomy.parts if part not in body.sizes]
    missing += [joint.name for joint in anatomy.joints if joint.name not in body.offsets]
    if missing:
        raise ValueError(f"body: {', '.join(missing)} missing; an anatomy {anatomy.name!r} has them")
    sizes = np.array([body.sizes[part] for part in anatomy.parts])
    return Bdp(sizes, np.array([body.offsets[joint.name] for joint in anatomy.joints]))


def angles_by_name(anatomy: Anatomy, angles: Floats) -> dict[str, float]:
    return {name: float(angles[k]) for k, name in enumerate(anatomy.angles)}


def angles_of(anatomy: Anatomy, named: Mapping[str, float], others: Floats) -> Floats:
    """The angles of a message in the anatomy's order; those it does not name are taken from `others` (angles,)."""
    angles = others.copy()
    for name, value in named.items():
        if name not in anatomy.index:
            raise ValueError(f"joint angle {name!r} is not one of anatomy {anatomy.name!r}")
        angles[anatomy.index[name]] = value
    return angles


def _triple(row: Floats) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])
