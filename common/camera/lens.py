"""A lens: what a camera is without position and orientation."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera

SIZE_GUESS = "size"  # of the names in `validation.GUESSES`, that of a lens
# Of a side, from it to that whose middle is the principal point, up to which images have the lens' own pixels.  Chosen by
# hand: principal points are within a tenth of the middle, and scaled films have two thirds of a side or less.
NEAR_MIDDLE = 0.2
Sized = TypeVar("Sized", "Lens", Camera)


@dataclass(frozen=True)
class Lens:
    """size: (width, height) px.  matrix: (3, 3) px.  distortions: OpenCV's; of a fisheye lens its four coefficients.

    guessed: as of a `Camera`.
    """

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats
    fisheye: bool = False
    guessed: tuple[str, ...] = ()

    @classmethod
    def of(cls, camera: Camera) -> "Lens":
        """The lens of a camera's images, before they are rectified."""
        guessed = tuple(name for name in camera.guessed if name == SIZE_GUESS)
        if (lens := camera.fisheye) is not None:
            return cls(camera.name, lens.size, lens.matrix, lens.coefficients, True, guessed)
        return cls(camera.name, camera.size, camera.matrix, camera.distortions, guessed=guessed)


def of_images(one: Sized, size: tuple[int, int]) -> Sized:
    """Return the lens or camera with the known size (width, height) px of its images in the place of a guess.

    As it is without a guess, and where its principal point is not near their middle: such images are scaled ones.
    """
    apart = np.abs((2.0 * one.matrix[:2, 2] + 1.0) / size - 1.0).max()
    if SIZE_GUESS not in one.guessed or apart > NEAR_MIDDLE:
        return one
    known = tuple(name for name in one.guessed if name != SIZE_GUESS)
    if isinstance(one.fisheye, bool) or one.fisheye is None:
        return replace(one, size=size, guessed=known)
    lens = replace(one.fisheye, size=size)
    return replace(one, size=size, guessed=known, fisheye=lens, matrix=lens.pinhole_matrix())
