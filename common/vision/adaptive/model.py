"""Adaptive model of a room: background, candidates, people; its start from first frames."""

# Paper (added): [Two-view 1] has a fixed model of an empty room.

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats32, Image, Mask
from zenocap.common.vision.background import Background, gains, learn, learn_median
from zenocap.common.vision.silhouette import Extents

SETTLING_GAIN = 0.02  # change of a colour while learning that is corrected; chosen by hand


@dataclass(frozen=True)
class Adaptive:
    """The model after a frame.  The arrays and the mean are changed in place: it belongs to one viewer.

    candidate: (height, width, 3) colour that a pixel shows, divided by the gain of the frame.  since_s: (height, width)
    time since when.  person, extents: last silhouette, or None.  alive_s: when the person's region last changed.
    noise: grey levels, median of the model's.  agreement: running mean of the share of the expected body that differs,
    without help of the prior.
    """

    background: Background
    candidate: Floats32
    since_s: Floats32
    noise: float
    person: Mask | None = None
    extents: Extents | None = None
    alive_s: float = -1e9
    frames: int = 0
    agreement: float = 0.0

    @property
    def room(self) -> Background:
        """Mean and noise of the empty room."""
        return self.background


def start(frames: Sequence[Image]) -> Adaptive:
    """Model of the first frames, which may show people.  Raises ValueError as `learn_median`.

    Frames in another light than the last, as of a camera whose white balance settles, are brought to that of the last.
    """
    background = learn_median(_in_one_light(frames))
    noise = float(np.median(background.sigma()))
    return Adaptive(background, background.mean.copy(), np.full(frames[0].shape[:2], -1e9, np.float32), noise)


def _in_one_light(frames: Sequence[Image]) -> list[Image]:
    last = learn(frames[-1:])
    lit = []
    for frame in frames:
        gain = gains(last, frame) if frame.shape == last.mean.shape else np.ones(3, np.float32)
        changed = np.abs(gain - 1.0).max() > SETTLING_GAIN
        lit.append(np.clip(np.rint(frame / gain), 0, 255).astype(np.uint8) if changed else frame)
    return lit
