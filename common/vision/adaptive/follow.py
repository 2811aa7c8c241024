"""A frame in, the silhouette of the person and the adaptive model after it out."""

from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.vision.adaptive.judgement import EXPLAINED_SHARE, judged
from zenocap.common.vision.adaptive.learning import LEARN, NEVER, SAME_SIGMAS, STRIDE, learn_still, visit
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.extraction import clean, with_halo
from zenocap.common.vision.foreground import foreground
from zenocap.common.vision.mask_refinement import Edges
from zenocap.common.vision.prediction import Prediction
from zenocap.common.vision.prior import explained_share, with_prior
from zenocap.common.vision.relight import relit
from zenocap.common.vision.semantics import NOT_PERSON, PERSON, overrule
from zenocap.common.vision.silhouette import PersonSilhouette, SilhouetteOptions

AGREEMENT_RATE = 0.2  # per frame, of the running mean of that share; chosen by hand
SUDDEN_SHARE = 0.25  # share of the image that differs after a sudden change of the light; chosen by hand
MARGIN_ROWS, MARGIN_MIN_PX = 40, 2  # image rows per px around the person of which nothing is learnt; chosen by hand


def follow(
    model: Adaptive,
    frame: Image,
    time_s: float,
    options: SilhouetteOptions,
    decided: Mask | None = None,
    prediction: Prediction | None = None,
) -> tuple[Adaptive, PersonSilhouette | None]:
    """Silhouette of the person in a frame (height, width, 3) uint8 BGR, and the model after it.

    time_s: of the frame, on any clock.  decided: (height, width) of `common.vision.semantics`: what is surely no person is
    learnt after STILL_S, and what surely is the person not at all; None: nothing is decided.  prediction: expected image of
    the tracked body; None without a confident pose.
    Raises ValueError when the frame's shape is not the model's.
    """
    background = model.background
    labels, gain = foreground(background, frame, options.foreground, background.halo)
    differing = int(np.count_nonzero(labels))
    if differing > SUDDEN_SHARE * labels.size:
        changed = relit(background, frame, model.person, differing, options.foreground)
        if changed is not None:
            model, background = replace(model, background=changed), changed
            labels, gain = foreground(background, frame, options.foreground, background.halo)
    if decided is not None:
        model = _with_decisions(model, frame, gain, labels, decided, time_s)
    model = _agreeing(model, labels, prediction)
    trusted = prediction if model.agreement >= EXPLAINED_SHARE else None
    if model.frames % STRIDE == 0:
        model = judged(model, frame, gain, labels, time_s, trusted)
    previous = model.extents if trusted is None else trusted.extents
    silhouette = clean(labels, options, previous, Edges(frame, background.mean, background.weight, gain))
    if silhouette is not None and trusted is not None:
        silhouette = with_prior(silhouette, labels, trusted, model.since_s, np.float32(time_s), options)
    held = _widened(labels.shape, silhouette)
    if trusted is not None:
        held[trusted.place] |= trusted.depth > -trusted.band
    same = np.float32(SAME_SIGMAS * model.noise)
    visit(
        frame, labels, held, gain, background.mean, model.candidate, model.since_s, np.float32(time_s), same,
        model.frames % STRIDE,
    )  # fmt: skip
    if silhouette is not None:
        if model.frames % STRIDE == 0:
            model = replace(model, background=with_halo(model.background, frame, gain, silhouette))
        model = replace(model, person=silhouette.mask, extents=silhouette.extents)
    return replace(model, frames=model.frames + 1), silhouette


def _with_decisions(
    model: Adaptive, frame: Image, gain: Floats32, labels: Labels, decided: Mask, time_s: float
) -> Adaptive:
    """Learn what is surely no person, renew what surely is the last one, and overrule the labels, in place."""
    if model.frames % STRIDE == 0:
        learnt = np.where(decided == NOT_PERSON, np.uint8(LEARN), np.uint8(NEVER))
        same = np.float32(SAME_SIGMAS * model.noise)
        learn_still(
            frame, labels, learnt, gain, model.background.mean, model.candidate, model.since_s, np.float32(time_s), same
        )
        model = replace(model, background=replace(model.background))
    if model.person is not None:
        model.since_s[(decided == PERSON) & (model.person != 0)] = time_s
    overrule(labels, decided)
    return model


def _agreeing(model: Adaptive, labels: Labels, prediction: Prediction | None) -> Adaptive:
    """The model with the agreement of this frame; 0 after a frame without a prediction."""
    if prediction is None:
        return replace(model, agreement=0.0) if model.agreement else model
    share = explained_share(labels[prediction.place], prediction.depth)
    before = model.agreement if model.agreement else share
    return replace(model, agreement=before + AGREEMENT_RATE * (share - before))


def _widened(shape: tuple[int, ...], silhouette: PersonSilhouette | None) -> Mask:
    """(height, width) 1 on the silhouette and around it, where nothing is learnt."""
    held = np.zeros(shape, np.uint8)
    if silhouette is not None:
        reach = max(MARGIN_MIN_PX, shape[0] // MARGIN_ROWS)
        left, right, top, bottom = silhouette.extents
        place = np.s_[max(0, top - reach) : bottom + reach + 1, max(0, left - reach) : right + reach + 1]
        held[place] = cv2.dilate(silhouette.mask[place], np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    return held
