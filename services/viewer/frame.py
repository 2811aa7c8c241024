"""Frames, the input events of the viewer's step: an image or, from a take, a recorded silhouette."""

from dataclasses import dataclass

from zenocap.common.arrays import Image, Mask
from zenocap.common.messages import Silhouette
from zenocap.common.vision.mask_codec import pack


@dataclass(frozen=True)
class Frame:
    """One image of a source.

    frame: number; frame k of a file has number k, so dropped frames leave gaps.  captured_ns: ns since the Unix epoch.
    image: (height, width, 3) blue, green, red at the working size.
    initial: from the separate video of the T-pose, which has its own frame numbers.
    """

    frame: int
    captured_ns: int
    image: Image
    initial: bool = False


@dataclass(frozen=True)
class SegmentedFrame:
    """Silhouette of a frame.  mask: (height, width), not 0 on the person; None without a person."""

    frame: int
    captured_ns: int
    mask: Mask | None


def silhouette_message(viewer: str, size: tuple[int, int], frame: Frame, mask: Mask | None) -> Silhouette:
    """Silhouette message of a mask (height, width); an empty one for a frame without a person.  size: of the camera."""
    region, data = ((0, 0, 0, 0), b"") if mask is None else pack(mask)
    return Silhouette(frame=frame.frame, captured_ns=frame.captured_ns, viewer=viewer, size=size, region=region, data=data)
