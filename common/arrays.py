"""Array types by element type.  Shapes, units and frames are stated where an array is used."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int64]
Ints32 = NDArray[np.int32]
Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]

Image = NDArray[np.uint8]
"""(height, width, 3) blue, green, red, or (height, width) grey."""

LARGEST_PX = 1 << 26  # of an image in a file, so that none fills the memory; above 8K, and cameras of 60 MP; by hand

Mask = NDArray[np.uint8]
"""(height, width), 0 where the background is, any other value where the person is."""

Labels = NDArray[np.uint8]
"""(height, width), class of every pixel."""
