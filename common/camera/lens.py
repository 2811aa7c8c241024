"""A lens: what a camera is without position and orientation."""

from dataclasses import dataclass

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera


@dataclass(frozen=True)
class Lens:
    """size: (width, height) px.  matrix: (3, 3) px.  distortions: OpenCV's; of a fisheye lens its four coefficients."""

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats
    fisheye: bool = False

    @classmethod
    def of(cls, camera: Camera) -> "Lens":
        """The lens of a camera's images, before they are rectified."""
        if (lens := camera.fisheye) is not None:
            return cls(camera.name, lens.size, lens.matrix, lens.coefficients, True)
        return cls(camera.name, camera.size, camera.matrix, camera.distortions)
