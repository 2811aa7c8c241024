"""Tests for every anatomy, and mirrored poses."""

import pytest

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import ANATOMIES, Anatomy

each_anatomy = pytest.mark.parametrize("anatomy", ANATOMIES.values(), ids=ANATOMIES)


def other_side(name: str) -> str:
    """The name with left and right exchanged."""
    return name.replace("right", "*").replace("left", "right").replace("*", "left")


def mirrored(anatomy: Anatomy, angles: Floats) -> Floats:
    """(..., angles) of the pose in a mirror: rotations about X stay, those about Y and Z change their sign."""
    order = [anatomy.index[other_side(name)] for name in anatomy.angles]
    signs = [1.0 if name.endswith(".x") else -1.0 for name in anatomy.angles]
    found: Floats = signs * angles[..., order]
    return found
