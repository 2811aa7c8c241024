"""Matching score of two binary images, by counting every pixel: the oracle of the incremental scorer.  [Two-view 2.3]"""

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8] | NDArray[np.bool_]


def matching_score(silhouette: Mask, model: Mask) -> float:
    """Matching score S of a silhouette and a model image, in [0, 1].  [Two-view Eq. 1]

    silhouette, model: (height, width), non-zero inside, same view.  Raises ValueError when the shapes differ.
    Returns exp(-p - n) (1 - p); 1.0 when both are equal, also when both are empty.
    """
    if silhouette.shape != model.shape:
        raise ValueError(f"silhouette has shape {silhouette.shape}, model image {model.shape}; they must be equal")
    image, model_image = silhouette != 0, model != 0
    union = np.count_nonzero(image | model_image)
    if union == 0:
        return 1.0
    p = np.count_nonzero(image & ~model_image) / union
    n = np.count_nonzero(model_image & ~image) / union
    return float(np.exp(-p - n) * (1 - p))
