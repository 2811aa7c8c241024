"""Segmentation: background model, silhouette and preview of a viewer's frames, for both methods."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from zenocap.common.arrays import Image, Mask
from zenocap.common.messages import CameraAdvice, Message, Preview
from zenocap.common.rig.sources import AdaptiveBackground, BackgroundImage, FirstFrames, Mog2, learning_frames
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.model import Adaptive, start
from zenocap.common.vision.adaptive.saved import taken_up
from zenocap.common.vision.background import Background, from_image, gains, learn_median, update
from zenocap.common.vision.background import learn as learn_from
from zenocap.common.vision.empty_scene import FEWEST_EMPTY, LEAST_EMPTY, with_people
from zenocap.common.vision.extraction import extract, with_halo
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.pictures import jpeg
from zenocap.common.vision.prediction import Prediction
from zenocap.common.vision.semantics import decision
from zenocap.common.vision.silhouette import SilhouetteOptions
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.advice.watch import AdviceWatch, watched
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.states import LearningBackground, Segmentation, ViewerSetup

Learning = TypeVar("Learning", bound=LearningBackground)
OPTIONS, NEAREST = SilhouetteOptions(), SilhouetteOptions(choice="nearest")


def learn(setup: ViewerSetup, state: Learning, image: Image | None) -> tuple[Learning, Segmentation | None]:
    """Add an image of the scene, None for one that is not in the take; returns the `Segmentation` once there are enough.

    A background of an earlier run is taken up with the first image that it fits.
    """
    if setup.kept is not None and image is not None:
        model = taken_up(setup.kept, image, OPTIONS.foreground)
        if model is not None:
            return state, Segmentation(model, restored=True)
    if image is not None and state.seen % state.stride == 0:
        state = _thinned(replace(state, images=(*state.images, image)), p.LEARNT_PX // (image.shape[0] * image.shape[1]))
    state = replace(state, seen=state.seen + 1)
    if state.seen < learning_frames(setup.background):
        return state, None
    images = state.images
    if isinstance(setup.background, FirstFrames) and images:
        people = with_people(images)
        empty = [image for image, seen in zip(images, people, strict=True) if not seen]
        watch = AdviceWatch(occupied=100.0 * float(people.mean()))
        enough = len(empty) >= (LEAST_EMPTY if len(images) >= 2 * LEAST_EMPTY else FEWEST_EMPTY)
        return state, Segmentation(learn_from(empty if enough else images), watch=watch)
    return state, Segmentation(_background(setup, images))


def _thinned(state: Learning, most: int) -> Learning:
    """The state with every second of its images where they are more than `most`, and more than two."""
    if len(state.images) <= max(2, most):
        return state
    return replace(state, images=state.images[::2], stride=2 * state.stride)


def _background(setup: ViewerSetup, images: Sequence[Image]) -> Background | Mixture | Adaptive | None:
    if not images:
        return None
    match setup.background:
        case BackgroundImage():
            assert setup.plate is not None  # checked by the setup
            return from_image(setup.plate, images)
        case AdaptiveBackground():
            return start(images)
        case Mog2():
            return Mixture(images, noise=p.MIXTURE_NOISE)
        case _:
            return learn_median(images)


def segment(
    setup: ViewerSetup, scene: Segmentation, frame: Frame, prediction: Prediction | None = None
) -> tuple[Segmentation, Mask | None, list[Message]]:
    """Segment a frame: (scene, mask (height, width) or None without a person, preview and advice if they are due).

    prediction: expected image of the tracked body, for an adaptive background.
    """
    background = scene.background
    assert background is not None  # a scene learnt from frames has one
    decided = _decided(setup, scene, background, frame)
    if isinstance(background, Adaptive):
        background, silhouette = follow(background, frame.image, frame.captured_ns / 1e9, NEAREST, decided, prediction)
    else:
        silhouette = extract(background, frame.image, OPTIONS, scene.extents, decided)
    # Paper (added): the background model follows slow changes of the light.
    if isinstance(background, Background) and frame.frame % p.UPDATE_EVERY == 0:
        if silhouette is not None and frame.image.shape[0] < p.HALO_ROWS:
            background = with_halo(background, frame.image, gains(background, frame.image, silhouette.mask), silhouette)
        person = silhouette.mask if silhouette else np.zeros(frame.image.shape[:2], np.uint8)
        margin_px = max(p.UPDATE_MARGIN_MIN_PX, frame.image.shape[0] // p.UPDATE_MARGIN_ROWS)
        background = update(background, frame.image, person, p.UPDATE_RATE, margin_px=margin_px)
    previewed = setup.publish_preview and frame.captured_ns - scene.preview_ns >= p.PREVIEW_NS
    preview_ns = frame.captured_ns if previewed else scene.preview_ns
    mask = silhouette.mask if silhouette else None
    watch, faults = watched(scene.watch, frame.image, frame.captured_ns / 1e9, mask, background.room, setup.small_px)
    messages: list[Message] = [_preview_message(setup, frame)] if previewed else []
    if faults is not None:
        messages.append(CameraAdvice(frame=frame.frame, captured_ns=frame.captured_ns, viewer=setup.id, faults=faults))
    extents = silhouette.extents if silhouette else None
    return Segmentation(background, extents, preview_ns, watch, scene.restored), mask, messages


def _decided(
    setup: ViewerSetup, scene: Segmentation, background: Background | Mixture | Adaptive, frame: Frame
) -> Mask | None:
    """What the network of `people = true` decides, (height, width) of `common.vision.semantics`; None without it."""
    if setup.people is None:
        return None
    room = None if background.room is None else background.room.mean
    semantics = setup.people.latest(frame, room, scene.extents)
    return decision(semantics, frame.image, frame.captured_ns, background.noise)


def _preview_message(setup: ViewerSetup, frame: Frame) -> Preview:
    """Small JPEG image for setting up a rig; published only on request, since images stay on the machine of the camera."""
    jpeg_data = jpeg(frame.image, p.PREVIEW_PX, p.PREVIEW_JPEG_QUALITY)
    return Preview(frame=frame.frame, captured_ns=frame.captured_ns, viewer=setup.id, jpeg=jpeg_data)
