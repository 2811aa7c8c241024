"""Resize a source's images to the working size of the calibrated camera."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import SizeMismatch
from zenocap.common.rig.viewers import Viewer
from zenocap.services.viewer.parameters import LETTERBOX
from zenocap.services.viewer.sources.playback import Size

SAME_SHAPE = 0.01  # relative difference of width : height up to which an image is the calibrated one, scaled

Rectify = Callable[[Image], Image]


@dataclass(frozen=True)
class Fit:
    """Resizing of images.  calibrated: expected (width, height) of the source, px.  working: resulting size, px.

    rectify: of images of a fisheye lens at the working size; None for other lenses.  name: of the source, for errors.
    """

    calibrated: Size
    working: Size
    rectify: Rectify | None = None
    name: str = ""

    def named(self, name: object) -> "Fit":
        return replace(self, name=str(name))

    def check(self, width: int, height: int) -> None:
        """Raise SizeMismatch when images of this size do not fit the calibrated size."""
        across, down = width / self.calibrated[0], height / self.calibrated[1]
        if max(abs(across - 1.0), abs(down - 1.0)) >= LETTERBOX and abs(across / down - 1.0) > SAME_SHAPE:
            turned = abs(width / self.calibrated[1] - 1.0) < LETTERBOX > abs(height / self.calibrated[0] - 1.0)
            advice = "one of them is turned by 90 degrees" if turned else "calibrate with images of that shape"
            raise SizeMismatch(
                f"{self.name}: images of {width} x {height} px, but the calibration is for "
                f"{self.calibrated[0]} x {self.calibrated[1]} px: allowed: the same shape, width : height within "
                f"{SAME_SHAPE:.0%}; {advice}"
            )

    def __call__(self, image: Image) -> Image:
        """Return the image at the working size, rectified, (height, width, 3).  Raises SizeMismatch.

        An image of another size and the same shape is scaled.  A small difference from the calibrated size is treated as
        uniform scaling about the centre followed by padding or cropping, as video converters do; it is reverted.
        """
        height, width = image.shape[:2]
        self.check(width, height)
        if (width, height) != self.calibrated and abs(width / self.calibrated[0] - 1.0) < LETTERBOX:
            image = _unletterboxed(image, self.calibrated)
        if image.shape[1::-1] != self.working:
            image = np.asarray(cv2.resize(image, self.working, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        return image if self.rectify is None else self.rectify(image)


def fit_of(viewer: Viewer) -> Fit:
    """Resizing of the images of a viewer's source, without a name."""
    return Fit(viewer.calibrated_size, viewer.camera.size, rectification(viewer.camera))


def rectification(camera: Camera) -> Rectify | None:
    """Rectification of the images of a fisheye lens at the size of its camera; None for other lenses."""
    return None if camera.fisheye is None else camera.fisheye.rectification(camera.matrix, camera.size)


def _unletterboxed(image: Image, calibrated: Size) -> Image:
    """Return the part of the image that the calibrated image shows, padded where the image has no pixels."""
    height, width = image.shape[:2]
    ratios = calibrated[0] / width, calibrated[1] / height
    scale = max(ratios, key=lambda ratio: abs(np.log(ratio)))
    right, down = round(calibrated[0] / scale) - width, round(calibrated[1] / scale) - height
    left, top = right // 2, down // 2
    right, down = right - left, down - top
    kept = image[max(0, -top) : height - max(0, -down), max(0, -left) : width - max(0, -right)]
    border = (max(0, top), max(0, down), max(0, left), max(0, right))
    return np.asarray(cv2.copyMakeBorder(kept, *border, cv2.BORDER_REPLICATE), dtype=np.uint8)
