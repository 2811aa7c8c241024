"""From a source's images to the working size that a viewer's camera is calibrated for."""

from dataclasses import dataclass

import cv2
import numpy as np

from services.viewer.sources.frame import Image, Size, SizeMismatch

NEARLY = 0.02  # relative difference to the calibrated size that is taken for a letterboxed rescaling of it


@dataclass(frozen=True)
class Fit:
    """calibrated: (width, height) px the source's images should have.  working: what they become."""

    name: str
    calibrated: Size
    working: Size

    def check(self, width: int, height: int) -> None:
        """Raises SizeMismatch when images of this size cannot be the calibrated ones."""
        ratios = width / self.calibrated[0], height / self.calibrated[1]
        if max(abs(ratio - 1.0) for ratio in ratios) >= NEARLY:
            raise SizeMismatch(
                f"{self.name}: images of {width} x {height} px, but the calibration is for "
                f"{self.calibrated[0]} x {self.calibrated[1]} px: allowed: that size, or less than "
                f"{NEARLY:.0%} off; calibrate at the size of the images, or set the camera to the calibrated size"
            )

    def __call__(self, image: Image) -> Image:
        """The image at the working size, (height, width, 3).  Raises SizeMismatch.

        An image that is not quite of the calibrated size was scaled alike in both directions about its middle and then
        padded or cut, as converters do: that is undone.
        """
        height, width = image.shape[:2]
        self.check(width, height)
        if (width, height) != self.calibrated:
            image = _unletterboxed(image, self.calibrated)
        if image.shape[1::-1] == self.working:
            return image
        return np.asarray(cv2.resize(image, self.working, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _unletterboxed(image: Image, calibrated: Size) -> Image:
    """The part of the image, padded where there is none, that shows what the calibrated image shows."""
    height, width = image.shape[:2]
    ratios = calibrated[0] / width, calibrated[1] / height
    scale = max(ratios, key=lambda ratio: abs(np.log(ratio)))
    right, down = round(calibrated[0] / scale) - width, round(calibrated[1] / scale) - height
    left, top = right // 2, down // 2
    right, down = right - left, down - top
    kept = image[max(0, -top) : height - max(0, -down), max(0, -left) : width - max(0, -right)]
    border = (max(0, top), max(0, down), max(0, left), max(0, right))
    return np.asarray(cv2.copyMakeBorder(kept, *border, cv2.BORDER_REPLICATE), dtype=np.uint8)
