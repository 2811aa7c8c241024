"""A frame: what a viewer's source gives and its step sees."""

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
