"""Background model that lives: learns where people were, follows the light, and takes up what was moved.

Every frame visits one row of `STRIDE`: a pixel that shows the background moves the mean, and every pixel has a candidate,
the colour that it shows, with the time since when.  Every `STRIDE` frames the regions that differ are judged:

- *alive*: a share of its pixels has changed within ALIVE_S.  The alive region at the place of the last silhouette, or else
  the largest, is the person, and nothing of it is learnt;
- *uncovered*: the model has an edge along its outline and the frame has none.  Something has moved away, also a person who
  was there from the start: what is seen now is the room;
- *put down*: anything else that does not change, such as a chair that was moved.

What was uncovered, put down, or moved beside the person is learnt where it has not changed for STILL_S: the candidate
becomes the mean.  Should that ever have been the person, the room is uncovered when the person moves on.
After a sudden change of the light most of the image differs; see `zenocap.common.vision.relight`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Image, Ints, Ints32, Labels, Mask
from zenocap.common.jit import kernel
from zenocap.common.vision.background import Background, gains, learn, learn_median
from zenocap.common.vision.foreground import BACKGROUND, UNSURE, WEAK, expected_gain, foreground
from zenocap.common.vision.prediction import Prediction
from zenocap.common.vision.prior import explained_share, with_prior
from zenocap.common.vision.regions import Regions, find_regions
from zenocap.common.vision.relight import relit
from zenocap.common.vision.semantics import NOT_PERSON, PERSON, overrule
from zenocap.common.vision.silhouette import Edges, Extents, Silhouette, SilhouetteOptions, clean

STRIDE = 8  # frames in which every row is visited once; chosen by hand
MEAN_RATE = 0.05  # share of the difference that a visit takes over; chosen by hand
CANDIDATE_RATE = 0.25  # of a candidate's colour; chosen by hand
SAME_SIGMAS = 4.5  # of the typical noise, a channel's change that ends a candidate; chosen by hand
SAME_SHARE = 0.02  # of the brightness, added to that; chosen by hand
ALIVE_S, ALIVE_SHARE = 1.5, 0.03  # s; share of the pixels of a region; chosen by hand
STILL_S, FAINT_S = 0.7, 4.0  # s without a change before a pixel is learnt; FAINT_S in small regions; chosen by hand
SETTLING_GAIN = 0.02  # change of a colour while learning that is corrected; chosen by hand
HOLD_S = 60.0  # s for which the person's region is held although nothing of it changes; chosen by hand
EXPLAINED_HOLD_S = 600.0  # s of the same where the tracked body explains the region; chosen by hand
EXPLAINED_SHARE = 0.5  # of the expected body that differs, from which it explains a region; chosen by hand
AGREEMENT_RATE = 0.2  # per frame, of the running mean of that share; chosen by hand
BESIDE_BANDS = 1.5  # bands outside the expected body, from where a region is not explained by it; chosen by hand
OTHER_GAP = 0.15  # heights of the person, from there something else moves; chosen by hand
PREVIOUS_SHARE = 0.2  # of the largest overlap with the last silhouette, of a region of the person; chosen by hand
EDGE_RATIO = 1.5  # of the edges along an outline, model to frame, of an uncovered region; chosen by hand
SHORTEST = 10  # px, of an outline; chosen by hand
SMALLEST_REGION = 0.0008  # share of the image, of a region that is judged; chosen by hand
SUDDEN_SHARE = 0.25  # share of the image that differs after a sudden change of the light; chosen by hand
MARGIN_ROWS, MARGIN_MIN_PX = 40, 2  # image rows per px around the person of which nothing is learnt; chosen by hand
HALO_RATE, HALO_MAX = 0.1, 6.0  # of a judgement; largest; chosen by hand
HALO_INNER_PX, HALO_OUTER_PX = 3, 8  # px, ring in which the halo is measured: within a block of the compression
UPPER = 0.7  # of the height of a silhouette from the top, above the shadow; chosen by hand
HALO_QUANTILE, HALO_CHI = 0.9, 2.5003  # and the quantile of the chi distribution with three degrees of freedom
NEVER, LEARN, LATER = 0, 1, 2  # verdicts on a pixel that differs: person, learnt after STILL_S, after FAINT_S


@dataclass(frozen=True)
class Adaptive:
    """The model after a frame.  The arrays and the mean are changed in place: it belongs to one viewer.

    candidate: (height, width, 3) colour that a pixel shows, divided by the gain of the frame.  since_s: (height, width)
    time since when.  person, extents: last silhouette, or None.  alive_s: when the person's region last changed.
    noise: grey levels, median of the model's.  halo: noise around the person in units of the model's, which compression
    makes larger than 1.  agreement: running mean of the share of the expected body that differs, without help of the prior.
    """

    background: Background
    candidate: Floats32
    since_s: Floats32
    noise: float
    halo: float = 1.0
    person: Mask | None = None
    extents: Extents | None = None
    alive_s: float = -1e9
    frames: int = 0
    agreement: float = 0.0


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


def follow(
    model: Adaptive,
    frame: Image,
    time_s: float,
    options: SilhouetteOptions,
    decided: Mask | None = None,
    prediction: Prediction | None = None,
) -> tuple[Adaptive, Silhouette | None]:
    """Silhouette of the person in a frame (height, width, 3) uint8 BGR, and the model after it.

    time_s: of the frame, on any clock.  decided: (height, width) of `common.vision.semantics`: what is surely no person is
    learnt after STILL_S, and what surely is the person not at all; None: nothing is decided.  prediction: expected image of
    the tracked body; None without a confident pose.
    Raises ValueError when the frame's shape is not the model's.
    """
    background = model.background
    gain = expected_gain(background, frame, options.foreground)
    labels = foreground(background, frame, gain, options.foreground, model.halo)
    differing = int(np.count_nonzero(labels))
    if differing > SUDDEN_SHARE * labels.size:
        changed = relit(background, frame, model.person, differing, options.foreground)
        if changed is not None:
            model, background = replace(model, background=changed), changed
            gain = expected_gain(background, frame, options.foreground)
            labels = foreground(background, frame, gain, options.foreground, model.halo)
    if decided is not None:
        _take_decisions(model, frame, gain, labels, decided, time_s)
    model = _agreeing(model, labels, prediction)
    trusted = prediction if model.agreement >= EXPLAINED_SHARE else None
    if model.frames % STRIDE == 0:
        model = _judged(model, frame, gain, labels, time_s, trusted)
    previous = model.extents if trusted is None else trusted.extents
    silhouette = clean(labels, options, previous, Edges(frame, background.mean, background.weight, gain))
    if silhouette is not None and trusted is not None:
        silhouette = with_prior(silhouette, labels, trusted, model.since_s, np.float32(time_s), options)
    held = _widened(labels.shape, silhouette)
    if trusted is not None:
        held[trusted.place] |= trusted.depth > -trusted.band
    same = np.float32(SAME_SIGMAS * model.noise)
    _visit(
        frame, labels, held, gain, background.mean, model.candidate, model.since_s, np.float32(time_s), same,
        model.frames % STRIDE,
    )  # fmt: skip
    if silhouette is not None:
        halo = model.halo
        if model.frames % STRIDE == 0:
            halo += HALO_RATE * (_halo(frame, background, gain, silhouette) - halo)
        model = replace(model, person=silhouette.mask, extents=silhouette.extents, halo=halo)
    return replace(model, frames=model.frames + 1), silhouette


def _take_decisions(model: Adaptive, frame: Image, gain: Floats32, labels: Labels, decided: Mask, time_s: float) -> None:
    """Learn what is surely no person, renew what surely is the last one, and overrule the labels, in place."""
    if model.frames % STRIDE == 0:
        learnt = np.where(decided == NOT_PERSON, np.uint8(LEARN), np.uint8(NEVER))
        same = np.float32(SAME_SIGMAS * model.noise)
        _learn(frame, labels, learnt, gain, model.background.mean, model.candidate, model.since_s, np.float32(time_s), same)
        model.background.forget_limits()
    if model.person is not None:
        model.since_s[(decided == PERSON) & (model.person != 0)] = time_s
    overrule(labels, decided)


def _agreeing(model: Adaptive, labels: Labels, prediction: Prediction | None) -> Adaptive:
    """The model with the agreement of this frame; 0 after a frame without a prediction."""
    if prediction is None:
        return replace(model, agreement=0.0) if model.agreement else model
    share = explained_share(labels[prediction.place], prediction.depth)
    before = model.agreement if model.agreement else share
    return replace(model, agreement=before + AGREEMENT_RATE * (share - before))


def _widened(shape: tuple[int, ...], silhouette: Silhouette | None) -> Mask:
    """(height, width) 1 on the silhouette and around it, where nothing is learnt."""
    held = np.zeros(shape, np.uint8)
    if silhouette is not None:
        reach = max(MARGIN_MIN_PX, shape[0] // MARGIN_ROWS)
        left, right, top, bottom = silhouette.extents
        place = np.s_[max(0, top - reach) : bottom + reach + 1, max(0, left - reach) : right + reach + 1]
        held[place] = cv2.dilate(silhouette.mask[place], np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    return held


@kernel
def _visit(
    frame: Image,
    labels: Labels,
    held: Mask,
    gain: Floats32,
    mean: Floats32,
    candidate: Floats32,
    since: Floats32,
    now_s: np.float32,
    same: np.float32,
    first: int,
) -> None:
    """Visit every STRIDE-th row from `first`, in place."""
    height, width = labels.shape
    value = np.empty(3, dtype=np.float32)
    for y in range(first, height, STRIDE):
        for x in range(width):
            near = True
            for c in range(3):
                value[c] = np.float32(frame[y, x, c]) / gain[c]
                near = near and abs(value[c] - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value[c]
            if not near:
                since[y, x] = now_s
            rate = np.float32(CANDIDATE_RATE) if near else np.float32(1)
            for c in range(3):
                candidate[y, x, c] += rate * (value[c] - candidate[y, x, c])
            if labels[y, x] == BACKGROUND and held[y, x] == 0:
                for c in range(3):
                    mean[y, x, c] += np.float32(MEAN_RATE) * (value[c] - mean[y, x, c])


def _judged(
    model: Adaptive, frame: Image, gain: Floats32, labels: Labels, time_s: float, trusted: Prediction | None
) -> Adaptive:
    """The model with the regions that differ judged and learnt; the labels of what was learnt become BACKGROUND."""
    shape, smallest = labels.shape, SMALLEST_REGION * labels.size
    differs = _joined(labels >= UNSURE)
    still = _joined((differs != 0) & (model.since_s < time_s - ALIVE_S))
    learnt = np.full(shape, LATER, dtype=np.uint8)
    # 1: what no longer moves and has an outline in the model only, also where it touches the person.
    regions = find_regions(still, 1, 1, 1, True)
    if (regions.areas >= smallest).any():
        number = _numbered(regions.runs, *shape)
        moving = cv2.dilate(((differs != 0) & (still == 0)).astype(np.uint8), np.ones((3, 3), np.uint8))
        for r in np.flatnonzero(regions.areas >= smallest):
            place, own, outline = _outline(regions, int(r), number)
            edges = _edges(frame[place]), _edges(model.background.mean[place])
            if _edge_ratio(edges, outline & (moving[place] == 0)) > EDGE_RATIO:
                learnt[place][own] = LEARN
                differs[place][own] = 0
    # 2: the person, and the rest.
    regions, alive_s = find_regions(differs, 1, 1, 1, True), model.alive_s
    if len(regions.areas) > 0:
        number = _numbered(regions.runs, *shape)
        hold_s = HOLD_S if trusted is None else EXPLAINED_HOLD_S
        verdicts, chosen, alive_s = _verdicts(model, labels, regions, number, time_s, hold_s)
        learnt = np.where(number > 0, verdicts[number], learnt).astype(np.uint8)
        if trusted is not None and chosen >= 0:
            _explain(trusted, number, chosen + 1, learnt)
    same = np.float32(SAME_SIGMAS * model.noise)
    _learn(frame, labels, learnt, gain, model.background.mean, model.candidate, model.since_s, np.float32(time_s), same)
    model.background.forget_limits()
    return replace(model, alive_s=alive_s)


def _explain(trusted: Prediction, number: Ints32, person: int, learnt: Mask) -> None:
    """Correct the verdicts where a body is expected in the person's region, in place.

    What the body explains is never learnt, in whatever region it is; of the person's region the rest is, where it is still.
    """
    own = number == person
    beside = own.copy()
    beside[trusted.place] &= trusted.depth < -BESIDE_BANDS * trusted.band
    body = trusted.depth > 0
    if np.count_nonzero(own[trusted.place] & body) < EXPLAINED_SHARE * np.count_nonzero(body):
        return
    near = trusted.depth > -trusted.band
    learnt[beside] = LATER
    learnt[trusted.place][near & (number[trusted.place] > 0)] = NEVER


def _verdicts(
    model: Adaptive, labels: Labels, regions: Regions, number: Ints32, time_s: float, hold_s: float
) -> tuple[Mask, int, float]:
    """Verdict on every region, after one for none; the person's region, or -1; and when that last changed."""
    sums = np.zeros((3, len(regions.areas) + 1), dtype=np.int64)
    person = np.zeros(labels.shape, np.uint8) if model.person is None else model.person
    _count(number, model.since_s, person, labels, np.float32(time_s - ALIVE_S), sums)
    changed, previous, seeds = sums[:, 1:]
    large = regions.areas >= SMALLEST_REGION * labels.size
    alive = large & (changed >= ALIVE_SHARE * regions.areas)
    verdicts = np.where(large, LEARN, LATER).astype(np.uint8)
    verdicts[alive] = NEVER
    chosen, alive_s = -1, model.alive_s
    if alive.any():
        near = alive & (previous > PREVIOUS_SHARE * max(1, previous[alive].max()))
        chosen, alive_s = int(np.argmax(np.where(near if near.any() else alive, seeds, -1))), time_s
    elif previous.any() and time_s - alive_s < hold_s:
        chosen = int(np.argmax(previous))
    if chosen >= 0:
        verdicts[alive & (_gaps(regions, chosen) > OTHER_GAP)] = LEARN
        verdicts[chosen] = NEVER
    return np.concatenate([np.full(1, LATER, np.uint8), verdicts]), chosen, alive_s


@kernel
def _learn(
    frame: Image,
    labels: Labels,
    learnt: Mask,
    gain: Floats32,
    mean: Floats32,
    candidate: Floats32,
    since: Floats32,
    now_s: np.float32,
    same: np.float32,
) -> None:
    """Take the candidate for the mean where it is still seen and has been for long enough, in place."""
    height, width = labels.shape
    for y in range(height):
        for x in range(width):
            if labels[y, x] == BACKGROUND or learnt[y, x] == NEVER:
                continue
            if now_s - since[y, x] < np.float32(STILL_S if learnt[y, x] == LEARN else FAINT_S):
                continue
            near = True
            for c in range(3):
                value = np.float32(frame[y, x, c]) / gain[c]
                near = near and abs(value - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value
            if near:
                labels[y, x] = BACKGROUND
                for c in range(3):
                    mean[y, x, c] = candidate[y, x, c]


def _halo(frame: Image, background: Background, gain: Floats32, silhouette: Silhouette) -> float:
    """Noise around the upper part of a silhouette in units of the model's, 1 to HALO_MAX; 1 without enough pixels.

    The ring from HALO_INNER_PX to HALO_OUTER_PX around it shows the room: distances from the model follow a chi
    distribution with three degrees of freedom where the noise is that of the model.
    """
    e = silhouette.extents
    knee = e.highest + round(UPPER * (e.lowest - e.highest))
    pad = HALO_OUTER_PX + 1
    place = np.s_[max(0, e.highest - pad) : knee, max(0, e.leftmost - pad) : e.rightmost + pad]
    mask = silhouette.mask[place]
    inner = cv2.dilate(mask, np.ones((2 * HALO_INNER_PX + 1,) * 2, np.uint8))
    ring = (cv2.dilate(mask, np.ones((2 * HALO_OUTER_PX + 1,) * 2, np.uint8)) != 0) & (inner == 0)
    if np.count_nonzero(ring) < 50:
        return 1.0
    off = frame[place][ring] - gain * background.mean[place][ring]
    distances = np.sqrt(np.sum(off * off * background.weight[place][ring], axis=1))
    return float(np.clip(np.quantile(distances, HALO_QUANTILE) / HALO_CHI, 1.0, HALO_MAX))


def _gaps(regions: Regions, chosen: int) -> Floats:
    """Distance between the box of every region and that of the chosen one, in heights of the latter."""
    box = regions.boxes[chosen]
    across = np.maximum(regions.boxes[:, 0] - box[2], box[0] - regions.boxes[:, 2])
    down = np.maximum(regions.boxes[:, 1] - box[3], box[1] - regions.boxes[:, 3])
    return np.asarray(np.maximum(across, down) / max(1, box[3] - box[1]))


def _joined(differs: Bools) -> Mask:
    """Mask of 0 and 1 with cracks closed and specks removed."""
    closed = cv2.morphologyEx(differs.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return np.asarray(cv2.medianBlur(closed, 3), dtype=np.uint8)


def _outline(regions: Regions, region: int, number: Ints32) -> tuple[tuple[slice, slice], Bools, Bools]:
    """Place of a region with a margin; in it: the pixels of the region, and those within one pixel of its outline."""
    left, top, right, bottom = (int(v) for v in regions.boxes[region])
    place = (slice(max(0, top - 2), bottom + 2), slice(max(0, left - 2), right + 2))
    own = number[place] == region + 1
    return place, own, cv2.morphologyEx(own.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) != 0


def _edge_ratio(edges: tuple[Floats32, Floats32], outline: Bools) -> float:
    """Mean edge of the model over that of the frame along an outline; 0 for an outline of fewer than SHORTEST pixels."""
    here, known = edges
    if np.count_nonzero(outline) < SHORTEST:
        return 0.0
    return float(known[outline].mean()) / max(float(here[outline].mean()), 1e-3)


@kernel
def _numbered(runs: Ints32, height: int, width: int) -> Ints32:
    """(height, width) number of the region from 1, 0 outside."""
    number = np.zeros((height, width), dtype=np.int32)
    for k in range(len(runs)):
        for x in range(runs[k, 1], runs[k, 2]):
            number[runs[k, 0], x] = runs[k, 3] + 1
    return number


@kernel
def _count(number: Ints32, since: Floats32, person: Mask, labels: Labels, after_s: np.float32, sums: Ints) -> None:
    """Pixels of each region that changed since a time, that were of the last silhouette, and that differ; in place."""
    for y in range(number.shape[0]):
        for x in range(number.shape[1]):
            r = number[y, x]
            if r > 0:
                sums[0, r] += since[y, x] > after_s
                sums[1, r] += person[y, x] != 0
                sums[2, r] += labels[y, x] >= WEAK


def _edges(image: Image | Floats32) -> Floats32:
    """Strength of the edges, (height, width): the largest of the channels, of the slightly blurred image."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0)
    across, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    blue, green, red = cv2.split(cv2.magnitude(across, down))
    return np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.float32)
