"""What a viewer's step sees of a camera: a picture, or, from a take, the silhouette that was found in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Frame:
    """image: (height, width, 3) blue, green, red at the working size.  captured_ns: since the Unix epoch.

    frame: a file's frame k has number k, so frames left out leave gaps.  initial: of the separate video of the initial
    posture, which counts for itself.
    """

    frame: int
    captured_ns: int
    image: Image
    initial: bool = False


@dataclass(frozen=True)
class Masked:
    """The silhouette of a frame that was seen before.  mask: (height, width), not 0 on the person; None without one."""

    frame: int
    captured_ns: int
    mask: NDArray[np.uint8] | None
