"""What every method's viewer does with its pictures: learn the scene, find the silhouette, and send it if asked to."""

from dataclasses import replace

import cv2
import numpy as np

from common.messages import Message, Preview
from common.messages import Silhouette as SilhouetteMessage
from common.runtime.specs import BackgroundImage, FirstFrames, Mog2, learning_frames
from common.vision.background import Background, from_image, learn_median, update
from common.vision.background import learn as learn_from
from common.vision.mixture import Mixture
from common.vision.packing import pack
from common.vision.silhouette import SilhouetteOptions, extract
from services.viewer.frame import Frame
from services.viewer.states import Image, LearningBackground, Mask, Seen, Setup

UPDATE_EVERY = 8  # frames between two updates of the background: light changes slowly, and updates cost time
UPDATE_RATE = 0.01
PREVIEW_NS, PREVIEW_PX = 200_000_000, 320  # at most 5 a second, of at most this width or height
OPTIONS = SilhouetteOptions()


def learn(setup: Setup, state: LearningBackground, image: Image | None) -> tuple[LearningBackground, Seen | None]:
    """One more picture of the scene, None for one that is not in the take; `Seen` once there are enough."""
    state = replace(state, frames=(*state.frames, image))
    if len(state.frames) < learning_frames(setup.background):
        return state, None
    return state, Seen(_background(setup, [image for image in state.frames if image is not None]))


def _background(setup: Setup, images: list[Image]) -> Background | Mixture | None:
    if not images:
        return None
    match setup.background:
        case FirstFrames():
            return learn_from(images)
        case BackgroundImage():
            assert setup.plate is not None  # viewer_setup checked it
            return from_image(setup.plate, images)
        case Mog2():
            return Mixture(images)
        case _:
            return learn_median(images)


def see(setup: Setup, seen: Seen, frame: Frame) -> tuple[Seen, Mask | None, list[Message]]:
    """The person's mask in a frame, (height, width) not 0 on the person, None without one; and a preview if it is due."""
    background = seen.background
    assert background is not None  # a state made from frames has one
    silhouette = extract(background, frame.image, OPTIONS, seen.extents)
    if isinstance(background, Background) and frame.frame % UPDATE_EVERY == 0:
        person = silhouette.mask if silhouette else np.zeros(frame.image.shape[:2], np.uint8)
        background = update(background, frame.image, person, UPDATE_RATE, margin_px=max(2, frame.image.shape[0] // 40))
    previewed = setup.publish_preview and frame.captured_ns - seen.preview_ns >= PREVIEW_NS
    preview_ns = frame.captured_ns if previewed else seen.preview_ns
    after = Seen(background, silhouette.extents if silhouette else None, preview_ns)
    return after, silhouette.mask if silhouette else None, [_preview_message(setup, frame)] if previewed else []


def silhouette_message(setup: Setup, frame: Frame, mask: Mask | None) -> SilhouetteMessage:
    """An empty mask says that nobody is in view."""
    width, height = setup.camera.size
    region, data = ((0, 0, 0, 0), b"") if mask is None else pack(mask)
    return SilhouetteMessage(
        frame=frame.frame, captured_ns=frame.captured_ns, viewer=setup.id, size=(width, height), region=region, data=data
    )


def _preview_message(setup: Setup, frame: Frame) -> Preview:
    """A small JPEG, for setting up a rig that asks for it: images otherwise stay on the camera's machine."""
    height, width = frame.image.shape[:2]
    scale = min(1.0, PREVIEW_PX / max(height, width))
    small = cv2.resize(frame.image, (round(scale * width), round(scale * height)), interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 70])
    return Preview(frame=frame.frame, captured_ns=frame.captured_ns, viewer=setup.id, jpeg=jpeg.tobytes())
