"""Background model that lives: learns where people were, follows the light, and takes up what was moved.

The model is a `Background` with three more arrays.  Every frame visits one row of `STRIDE`.  A visited pixel that shows the
background moves the mean; one that differs starts or continues a candidate, the colour that is seen there instead.  Every
`STRIDE` frames the regions that differ are judged:

- *alive*: a share of its pixels has changed within ALIVE_S.  The largest alive one, or the one at the place of the last
  silhouette, is the person, and nothing of it is learnt;
- *uncovered*: the model has an edge along its outline and the frame has none.  Something, also a person who was there from
  the start, has moved away; what is seen now is the room, and is learnt after UNCOVERED_S;
- *put down*: anything else that does not change.  Learnt after PUT_DOWN_S, and not part of a silhouette before.

After a sudden change of the light, most of the image differs.  A smooth map of gains is then fitted to the whole image, and
the model is multiplied by it.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Image, Ints, Ints32, Labels, Mask
from zenocap.common.jit import kernel
from zenocap.common.vision.background import Background, learn_median
from zenocap.common.vision.foreground import BACKGROUND, UNSURE, WEAK, expected_gain, foreground
from zenocap.common.vision.regions import Regions, find_regions
from zenocap.common.vision.silhouette import Edges, Extents, Silhouette, SilhouetteOptions, clean

STRIDE = 8  # frames in which every row is visited once; chosen by hand
MEAN_RATE = 0.05  # share of the difference that a visit takes over; chosen by hand
CANDIDATE_RATE = 0.25  # of a candidate's colour; chosen by hand
SAME_SHARE = 0.02  # of the brightness, added to that; chosen by hand
SAME_SIGMAS = 4.5  # of the typical noise, a channel's change that ends a candidate; chosen by hand
ALIVE_S, ALIVE_SHARE = 1.5, 0.03  # s; share of the pixels of a region; chosen by hand
UNCOVERED_S, PUT_DOWN_S, FAINT_S = 1.0, 20.0, 4.0  # s; chosen by hand
OCCLUDED_S = 3.0  # s for which a candidate is kept while something else is seen; chosen by hand
HOLD_S = 60.0  # s for which the person's region is held although nothing of it changes; chosen by hand
PREVIOUS_SHARE = 0.2  # of the largest overlap with the last silhouette, of a region of the person; chosen by hand
OTHER_GAP = 0.15  # heights of the person, from there something else moves; chosen by hand
EDGE_RATIO = 1.5  # of the edges along an outline, model to frame, of an uncovered region; chosen by hand
SMALLEST_REGION = 0.0008  # share of the image, of a region that is judged; chosen by hand
SUDDEN_SHARE = 0.25  # share of the image that differs after a sudden change of the light; chosen by hand
FIT_STEP_PX, FIT_ROUNDS = 6, 8  # of the map of gains: grid of samples, rounds of reweighting; chosen by hand
FIT_GAIN = 0.6  # share of the differing pixels that a map must explain; chosen by hand

HALO_RATE, HALO_MAX = 0.1, 6.0  # of a judgement; largest; chosen by hand
HALO_INNER_PX, HALO_OUTER_PX = 3, 8  # px, ring in which the halo is measured: within a block of the compression
UPPER = 0.7  # of the height of a silhouette from the top, above the shadow; chosen by hand
HALO_QUANTILE, HALO_CHI = 0.9, 2.5003  # and the quantile of the chi distribution with three degrees of freedom

# Verdicts on a pixel that differs.  PUT_DOWN to OTHER are not part of a silhouette while they do not change.
HELD, PUT_DOWN, UNCOVERED, OTHER, FAINT, FREE = 0, 1, 2, 3, 4, 5


@dataclass(frozen=True)
class Adaptive:
    """The model after a frame.

    candidate: (height, width, 3) colours seen where the model differs.  born_s: (height, width) time since when.
    last_s: when it was last seen.  changed_s: (height, width) time at which the pixel last showed another colour than its candidate.
    judged: (height, width) HALO_RATE, HALO_MAX = 0.1, 6.0  # of a judgement; largest; chosen by hand
HALO_INNER_PX, HALO_OUTER_PX = 3, 8  # px, ring in which the halo is measured: within a block of the compression
UPPER = 0.7  # of the height of a silhouette from the top, above the shadow; chosen by hand
HALO_QUANTILE, HALO_CHI = 0.9, 2.5003  # and the quantile of the chi distribution with three degrees of freedom

HELD, PUT_DOWN, UNCOVERED, FAINT or FREE.  person: last silhouette, or None.
    alive_s: when the person's region last changed.  noise: grey levels, median of the model's.
    halo: noise around the person in units of the model's, which compression makes larger than 1.
    """

    background: Background
    candidate: Floats32
    born_s: Floats32
    changed_s: Floats32
    last_s: Floats32
    judged: Mask
    person: Mask | None = None
    extents: Extents | None = None
    alive_s: float = -1e9
    frames: int = 0
    noise: float = 1.0
    halo: float = 1.0


def start(frames: "list[Image]") -> Adaptive:
    """Model of the first frames, which may show people.  Raises ValueError as `learn_median`."""
    background = learn_median(frames)
    shape = background.mean.shape
    noise = float(np.median(background.sigma()))
    return Adaptive(
        background, np.zeros(shape, np.float32), np.full(shape[:2], -1e9, np.float32), np.full(shape[:2], -1e9, np.float32),
        np.full(shape[:2], -1e9, np.float32), np.full(shape[:2], FREE, np.uint8), noise=noise,
    )  # fmt: skip


def follow(model: Adaptive, frame: Image, time_s: float, options: SilhouetteOptions) -> tuple[Adaptive, Silhouette | None]:
    """Silhouette of the person in a frame (height, width, 3) uint8 BGR, and the model after it.

    time_s: of the frame, on any clock.  Raises ValueError when the frame's shape is not the model's.
    """
    background = model.background
    gain = expected_gain(background, frame, options.foreground)
    labels = foreground(background, frame, gain, options.foreground, model.halo)
    if np.count_nonzero(labels) > SUDDEN_SHARE * labels.size:
        relit = _relit(background, frame, model.person, labels)
        if relit is not None:
            model = replace(model, background=relit)
            background = relit
            gain = expected_gain(background, frame, options.foreground)
            labels = foreground(background, frame, gain, options.foreground, model.halo)
    same = np.float32(SAME_SIGMAS * model.noise)
    _suppress(frame, labels, model.judged, gain, model.candidate, same)
    if model.frames % STRIDE == 0:
        before, model = model.judged, _judged(model, frame, labels, time_s)
        _renew(frame, before, model.judged, gain, model.candidate, model.born_s, model.last_s, np.float32(time_s), same)
        _suppress(frame, labels, model.judged, gain, model.candidate, same)
        background.forget_limits()
    silhouette = clean(labels, options, model.extents, Edges(frame, background.mean, background.weight, gain))
    held = np.zeros(labels.shape, np.uint8) if silhouette is None else _widened(silhouette.mask)
    waits = np.array([np.inf, PUT_DOWN_S, UNCOVERED_S, PUT_DOWN_S, FAINT_S, FAINT_S], dtype=np.float32)
    _visit(
        frame, labels, held, model.judged, gain, background.mean, model.candidate, model.born_s, model.changed_s,
        model.last_s,         np.float32(time_s), same, waits, model.frames % STRIDE,
    )  # fmt: skip
    if silhouette is not None:
        halo = model.halo
        if model.frames % STRIDE == 0:
            halo += HALO_RATE * (_halo(frame, background, gain, silhouette) - halo)
        model = replace(model, person=silhouette.mask, extents=silhouette.extents, halo=halo)
    return replace(model, frames=model.frames + 1), silhouette


@kernel
def _suppress(frame: Image, labels: Labels, judged: Mask, gain: Floats32, candidate: Floats32, same: np.float32) -> None:
    """Label as BACKGROUND what was uncovered or put down and still shows the same colour, in place."""
    height, width = labels.shape
    for y in range(height):
        for x in range(width):
            if labels[y, x] != BACKGROUND and PUT_DOWN <= judged[y, x] <= OTHER:
                near = True
                for c in range(3):
                    value = np.float32(frame[y, x, c]) / gain[c]
                    near = near and abs(value - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value
                if near:
                    labels[y, x] = BACKGROUND


def _widened(mask: Mask) -> Mask:
    reach = max(2, mask.shape[0] // 40)
    return np.asarray(cv2.dilate(mask, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)), dtype=np.uint8)


@kernel
def _renew(
    frame: Image, before: Mask, judged: Mask, gain: Floats32, candidate: Floats32, born: Floats32, last: Floats32,
    now_s: np.float32, same: np.float32,
) -> None:  # fmt: skip
    """Candidates of pixels that were just judged to be no part of the person and show another colour, in place."""
    for y in range(judged.shape[0]):
        for x in range(judged.shape[1]):
            if PUT_DOWN <= judged[y, x] <= OTHER and not PUT_DOWN <= before[y, x] <= OTHER:
                near = True
                for c in range(3):
                    value = np.float32(frame[y, x, c]) / gain[c]
                    near = near and abs(value - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value
                if not near:
                    born[y, x], last[y, x] = now_s, now_s
                    for c in range(3):
                        candidate[y, x, c] = np.float32(frame[y, x, c]) / gain[c]


@kernel
def _visit(
    frame: Image,
    labels: Labels,
    held: Mask,
    judged: Mask,
    gain: Floats32,
    mean: Floats32,
    candidate: Floats32,
    born: Floats32,
    changed: Floats32,
    last: Floats32,
    now_s: np.float32,
    same: np.float32,
    waits: Floats32,
    first: int,
) -> None:
    """Visit every STRIDE-th row from `first`, in place.

    A candidate is dropped when another colour is seen for as long as the candidate was, or for OCCLUDED_S.
    """
    height, width = labels.shape
    value = np.empty(3, dtype=np.float32)
    for y in range(first, height, STRIDE):
        for x in range(width):
            near, free = True, labels[y, x] == BACKGROUND and judged[y, x] > OTHER
            for c in range(3):
                value[c] = np.float32(frame[y, x, c]) / gain[c]
                near = near and abs(value[c] - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value[c]
            if near:
                last[y, x] = now_s
                for c in range(3):
                    candidate[y, x, c] += np.float32(CANDIDATE_RATE) * (value[c] - candidate[y, x, c])
            else:
                changed[y, x] = now_s
                bare = True
                for c in range(3):
                    bare = bare and abs(value[c] - mean[y, x, c]) <= same + np.float32(SAME_SHARE) * value[c]
                if free or bare or now_s - last[y, x] > min(np.float32(OCCLUDED_S), last[y, x] - born[y, x]):
                    born[y, x], last[y, x] = now_s, now_s
                    judged[y, x] = FREE
                    for c in range(3):
                        candidate[y, x, c] = value[c]
            if free:
                born[y, x] = now_s
            if free and held[y, x] == 0:
                for c in range(3):
                    mean[y, x, c] += np.float32(MEAN_RATE) * (value[c] - mean[y, x, c])
            elif not free and near and judged[y, x] != HELD and (held[y, x] == 0 or judged[y, x] <= OTHER):
                if now_s - born[y, x] >= waits[judged[y, x]]:
                    judged[y, x] = FREE
                    for c in range(3):
                        mean[y, x, c] = candidate[y, x, c]


def _judged(model: Adaptive, frame: Image, labels: Labels, time_s: float) -> Adaptive:
    """The model with its regions judged; labels: without what was judged before and is still the same."""
    shape = labels.shape
    differs = _joined(labels >= UNSURE)
    still = _joined((differs != 0) & (model.changed_s < time_s - ALIVE_S))
    # What was judged stays so until another colour is seen there.
    judged = np.where((model.judged >= PUT_DOWN) & (model.judged <= OTHER), model.judged, FREE).astype(np.uint8)
    edges = (_edges(frame), _edges(model.background.mean))
    # 1: what no longer moves and has an outline in the model only, also where it touches the person.
    regions = find_regions(still, 1, 1, 1, True)
    smallest = SMALLEST_REGION * labels.size
    if (regions.areas >= smallest).any():
        number = _numbered(regions.runs, *shape)
        moving = cv2.dilate(((differs != 0) & (still == 0)).astype(np.uint8), np.ones((3, 3), np.uint8))
        for r in np.flatnonzero(regions.areas >= smallest):
            place, own, outline = _outline(regions, int(r), number)
            ratio = _edge_ratio(edges, place, outline & (moving[place] == 0))
            if ratio > EDGE_RATIO:
                judged[place][own] = UNCOVERED
        differs[judged == UNCOVERED] = 0
    # 2: the person, and the rest.
    regions = find_regions(differs, 1, 1, 1, True)
    count = len(regions.areas)
    if count == 0:
        return replace(model, judged=judged)
    number = _numbered(regions.runs, *shape)
    sums = np.zeros((3, count + 1), dtype=np.int64)
    person = np.zeros(shape, np.uint8) if model.person is None else model.person
    _count(number, model.changed_s, person, labels, np.float32(time_s - ALIVE_S), sums)
    changed, previous, seeds = sums[:, 1:]
    large = regions.areas >= smallest
    alive = large & (changed >= ALIVE_SHARE * regions.areas)
    chosen, alive_s = -1, model.alive_s
    if alive.any():
        near = alive & (previous > PREVIOUS_SHARE * max(1, previous[alive].max()))
        chosen, alive_s = int(np.argmax(np.where(near if near.any() else alive, seeds, -1))), time_s
    elif previous.any() and time_s - alive_s < HOLD_S:
        chosen = int(np.argmax(previous))
    verdicts = np.where(large, PUT_DOWN, FAINT).astype(np.uint8)
    verdicts[alive] = HELD
    if chosen >= 0:
        verdicts[alive & (_gaps(regions, chosen) > OTHER_GAP)] = OTHER
        verdicts[chosen] = HELD
    verdicts = np.concatenate([[FREE], verdicts])
    return replace(model, judged=np.where(number > 0, verdicts[number], judged).astype(np.uint8), alive_s=alive_s)


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


def _edge_ratio(edges: tuple[Floats32, Floats32], place: tuple[slice, slice], outline: Bools) -> float:
    """Mean edge of the model over that of the frame along an outline; 0 for an outline of fewer than 10 pixels."""
    here, known = edges
    if np.count_nonzero(outline) < 10:
        return 0.0
    return float(known[place][outline].mean()) / max(float(here[place][outline].mean()), 1e-3)


@kernel
def _numbered(runs: Ints32, height: int, width: int) -> Ints32:
    """(height, width) number of the region from 1, 0 outside."""
    number = np.zeros((height, width), dtype=np.int32)
    for k in range(len(runs)):
        for x in range(runs[k, 1], runs[k, 2]):
            number[runs[k, 0], x] = runs[k, 3] + 1
    return number


@kernel
def _count(number: Ints32, changed: Floats32, person: Mask, labels: Labels, since_s: np.float32, sums: Ints) -> None:
    """Pixels of each region that changed since a time, that were of the last silhouette, and that differ; in place."""
    for y in range(number.shape[0]):
        for x in range(number.shape[1]):
            r = number[y, x]
            if r > 0:
                sums[0, r] += changed[y, x] > since_s
                sums[1, r] += person[y, x] != 0
                sums[2, r] += labels[y, x] >= WEAK


def _edges(image: Image | Floats32) -> Floats32:
    """Strength of the edges, (height, width): the largest of the channels, of the slightly blurred image."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0)
    across, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    return np.asarray(cv2.magnitude(across, down).max(axis=2), dtype=np.float32)


def _relit(background: Background, frame: Image, person: Mask | None, labels: Labels) -> Background | None:
    """The model in the light of the frame: multiplied by a smooth map of gains; None when no map explains the frame.

    The map is a polynomial of second degree of the logarithm of the ratio, for every channel, fitted to a grid of pixels by
    reweighted least squares (Cauchy).
    """
    height, width = labels.shape
    grid = np.s_[FIT_STEP_PX // 2 :: FIT_STEP_PX, FIT_STEP_PX // 2 :: FIT_STEP_PX]
    y, x = np.mgrid[0:height, 0:width]
    u, v = 2.0 * x / width - 1.0, 2.0 * y / height - 1.0
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)
    seen = cv2.blur(frame, (3, 3))[grid].astype(np.float64)
    known = cv2.blur(background.mean, (3, 3))[grid].astype(np.float64)
    usable = ((seen > 6) & (seen < 250) & (known > 6)).all(axis=-1)
    if person is not None:
        usable &= person[grid] == 0
    if np.count_nonzero(usable) < 50:
        return None
    design, field = terms[grid][usable], np.empty(background.mean.shape, np.float32)
    for c in range(3):
        logs = np.log(seen[..., c][usable] / known[..., c][usable])
        weight = np.ones(len(logs))
        found = np.zeros(6)
        found[0] = np.median(logs)
        for _ in range(FIT_ROUNDS):
            rest = logs - design @ found
            scale = max(1.4826 * float(np.median(np.abs(rest))), 0.005)
            weight = 1.0 / (1.0 + (rest / (2.0 * scale)) ** 2)
            root = np.sqrt(weight)[:, None]
            found = np.linalg.lstsq(design * root, logs * root[:, 0], rcond=None)[0]
        field[..., c] = np.exp(np.clip(terms @ found, -1.5, 1.5))
    relit = replace(background, mean=np.clip(background.mean * field, 0, 255).astype(np.float32))
    before = np.count_nonzero(labels)
    gain = expected_gain(relit, frame, SilhouetteOptions().foreground)
    after = np.count_nonzero(foreground(relit, frame, gain, SilhouetteOptions().foreground))
    return relit if after < (1.0 - FIT_GAIN) * before else None
