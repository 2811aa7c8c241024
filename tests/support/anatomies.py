"""Tests for every anatomy, and mirrored poses."""

import numpy as np
import pytest

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import ANATOMIES, Anatomy
from zenocap.common.body.definition import Bdp

each_anatomy = pytest.mark.parametrize("anatomy", ANATOMIES.values(), ids=ANATOMIES)


def other_side(name: str) -> str:
    """The name with left and right exchanged."""
    return name.replace("right", "*").replace("left", "right").replace("*", "left")


def assert_symmetric(anatomy: Anatomy, body: Bdp) -> None:
    """Parts and joints of the left are those of the right in a mirror."""
    right = [k for k, part in enumerate(anatomy.parts) if part.startswith("right_")]
    left = [anatomy.index[other_side(anatomy.parts[k])] for k in right]
    np.testing.assert_array_equal(body.sizes[right], body.sizes[left])
    np.testing.assert_array_equal(body.offsets[right] * [-1, 1, 1], body.offsets[left])
    assert np.all(body.offsets[right, 0] <= 0)


def mirrored(anatomy: Anatomy, angles: Floats) -> Floats:
    """(..., angles) of the pose in a mirror: rotations about X stay, those about Y and Z change their sign."""
    order = [anatomy.index[other_side(name)] for name in anatomy.angles]
    signs = [1.0 if name.endswith(".x") else -1.0 for name in anatomy.angles]
    found: Floats = signs * angles[..., order]
    return found
