"""A pose as the tracker has it, and what it is to everybody else."""

from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Pose
from common.body.rotation_vectors import vector_of


@dataclass(frozen=True, eq=False)
class Posed:
    """position: (3,) metres, rotation: (3, 3) of the root to the world, values: (d,) coordinates in radians."""

    position: Floats
    rotation: Floats
    values: Floats

    def copy(self) -> "Posed":
        return Posed(self.position.copy(), self.rotation.copy(), self.values.copy())

    def pose(self, anatomy: Anatomy) -> Pose:
        return Pose(self.position.copy(), coordinates_of(anatomy).angles(self.values, self.rotation))


def change(before: Posed, after: Posed) -> Floats:
    """(6 + d,) from one pose to the other: metres, rotation vector in the world, coordinates."""
    turn = np.empty(3)
    vector_of(after.rotation @ before.rotation.T, turn)
    return np.concatenate([after.position - before.position, turn, after.values - before.values])
