"""Recent measurements of a viewer's images, and the advice from them."""

from dataclasses import dataclass, replace
from typing import TypeVar

from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.messages import CameraFault
from zenocap.common.vision.background import Background
from zenocap.common.vision.image_measures import Exposure, cells_of, exposure
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.advice.edges import GREEN, Blur, EdgeOutline, moved_since, outline_of, room_edge_px
from zenocap.services.viewer.advice.faults import Measured, faults_of
from zenocap.services.viewer.advice.person import PersonSample, seen_person

T = TypeVar("T")


@dataclass(frozen=True)
class AdviceWatch:
    """Measures by capture time (s), oldest first.

    fast: cells of every image, for flicker.  slow: cells of each colour (cells down, cells across, 3).
    samples: of the person.  blurs: edges of the moving person.  outline: edges of the last sampled image, until the next
    image shows how far they have moved.  exposure: of the last sampled image.  edge_px: of the sharpest edges of the room.
    occupied: %, of the images that should show the empty scene, those with a person.
    """

    fast: tuple[tuple[float, Floats], ...] = ()
    slow: tuple[tuple[float, Floats], ...] = ()
    samples: tuple[PersonSample, ...] = ()
    blurs: tuple[tuple[float, Blur], ...] = ()
    outline: EdgeOutline | None = None
    exposure: Exposure | None = None
    edge_px: float | None = None
    occupied: float = 0.0
    sampled_s: float = -1e9
    focus_s: float = -1e9
    reported_s: float = -1e9


def watched(
    watch: AdviceWatch, image: Image, time_s: float, mask: Mask | None, room: Background | None,
    small_px: float = p.SMALL_PERSON,
) -> tuple[AdviceWatch, list[CameraFault] | None]:  # fmt: skip
    """Measure one image (height, width, 3): the measures after it, and the faults when they are due, otherwise None.

    mask: silhouette, None without a person.  room: of the background model; None where it has none.
    small_px: see `Measured`.
    """
    step = max(1, round(image.shape[1] / p.ADVICE_PX))
    fast = _since(
        (*watch.fast, (time_s, cells_of(image[::step, ::step, GREEN], p.ADVICE_CELLS))), time_s - p.ADVICE_FLICKER_S
    )
    watch = replace(watch, fast=fast)
    if watch.outline is not None:
        if mask is not None:
            blurs = (*watch.blurs, (time_s, moved_since(watch.outline, mask)))
            watch = replace(watch, blurs=_since(blurs, time_s - p.ADVICE_WINDOW_S))
        watch = replace(watch, outline=None)
    if time_s - watch.sampled_s >= p.ADVICE_SAMPLE_S:
        watch = _sampled(watch, image[::step, ::step], time_s)
        if mask is not None and room is not None:
            watch = _with_person(watch, image, room, mask, time_s)
    if watch.reported_s < 0:
        return replace(watch, reported_s=time_s), None
    if time_s - watch.reported_s < p.ADVICE_REPORT_S:
        return watch, None
    if time_s - watch.focus_s >= p.ADVICE_FOCUS_S:
        watch = replace(watch, edge_px=None if room is None else room_edge_px(room.mean), focus_s=time_s)
    found = Measured(
        watch.fast, watch.slow, [one for one in watch.samples if time_s - one.time_s <= p.ADVICE_WINDOW_S],
        [one for at_s, one in watch.blurs if time_s - at_s <= p.ADVICE_WINDOW_S], watch.exposure,
        watch.edge_px, image.shape[0], watch.occupied, small_px,
    )  # fmt: skip
    return replace(watch, reported_s=time_s), faults_of(found)


def _sampled(watch: AdviceWatch, small: Image, time_s: float) -> AdviceWatch:
    slow = _since((*watch.slow, (time_s, cells_of(small, p.ADVICE_CELLS))), time_s - p.ADVICE_LIGHT_S)
    return replace(watch, slow=slow, exposure=exposure(small), sampled_s=time_s)


def _with_person(watch: AdviceWatch, image: Image, room: Background, mask: Mask, time_s: float) -> AdviceWatch:
    found = seen_person(image, room, mask, time_s)
    if found is None:
        return watch
    sample, gain, top, bottom = found
    kept = [one for one in watch.samples if time_s - one.time_s <= p.ADVICE_WINDOW_S]
    outline = outline_of(image, room.mean, float(gain[GREEN]), mask, top, bottom)
    return replace(watch, samples=(*kept, sample), outline=outline)


def _since(items: tuple[tuple[float, T], ...], start_s: float) -> tuple[tuple[float, T], ...]:
    first = next((k for k, (time_s, _) in enumerate(items) if time_s >= start_s), len(items))
    return items[first:]
