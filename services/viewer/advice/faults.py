"""Faults of a camera's images, from what was measured over the last seconds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera_advice import severity
from zenocap.common.messages import AdviceCode, CameraFault, Third
from zenocap.common.vision.image_measures import Exposure, light
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.advice.edges import Blur, blur_percent
from zenocap.services.viewer.advice.person import PersonSample

THIRDS: tuple[Third, Third, Third] = ("upper", "middle", "lower")
DIGITS = 2
Unit = Literal["levels", "%", "px"]


@dataclass(frozen=True)
class Measured:
    """Measures of the last seconds, with times in s, see `watch.Watch`.  edge_px: of the room.  rows: of the image.

    occupied: as of the watch.  small_px: height of a person below which he or she is too small.
    """

    fast: Sequence[tuple[float, Floats]]
    slow: Sequence[tuple[float, Floats]]
    samples: Sequence[PersonSample]
    blurs: list[Blur]
    exposure: Exposure | None
    edge_px: float | None
    rows: int
    occupied: float
    small_px: float


LOW = (AdviceCode.CONTRAST, AdviceCode.SMALL, AdviceCode.DARK)  # faults where the value is below the limit
UNSTEADY = (AdviceCode.LIGHT_DRIFT, AdviceCode.WHITE_BALANCE)
OF_PERSON = (
    AdviceCode.CONTRAST, AdviceCode.HOLES, AdviceCode.GLOSSY_FLOOR, AdviceCode.CUT_OFF, AdviceCode.SMALL,
    AdviceCode.MOTION_BLUR,
)  # fmt: skip


def faults_of(found: Measured) -> list[CameraFault]:
    """The faults, the worst first.  While the light changes, silhouettes may be wrong: the person is then left out."""
    faults = [one for one in values_of(found) if is_fault(one)]
    if any(one.code in UNSTEADY for one in faults):
        faults = [one for one in faults if one.code not in OF_PERSON]
    return sorted(faults, key=lambda one: -severity(one))


def is_fault(one: CameraFault) -> bool:
    return one.value < one.limit if one.code in LOW else abs(one.value) > one.limit


def values_of(found: Measured) -> Iterator[CameraFault]:
    """All measured values, good and bad."""
    yield _value(AdviceCode.OCCUPIED, found.occupied, p.SOME_OCCUPIED, "%")
    yield from _of_person(found)
    yield from _of_light(found)
    yield from _of_lens(found)


def _value(code: AdviceCode, value: float, limit: float, unit: Unit, part: Third = "") -> CameraFault:
    return CameraFault(code=code, value=round(value, DIGITS), limit=round(limit, DIGITS), unit=unit, part=part)


def _of_person(found: Measured) -> Iterator[CameraFault]:
    samples = found.samples
    if len(samples) < p.ADVICE_SAMPLES:
        return
    contrast = np.array([one.contrast for one in samples])
    for part, values in zip(THIRDS, contrast.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known):
            yield _value(AdviceCode.CONTRAST, float(np.median(known)), p.LOW_CONTRAST, "levels", part)
    yield _value(AdviceCode.HOLES, float(np.median([one.holes for one in samples])), p.MANY_HOLES, "%")
    mirrored = 100.0 * float(np.mean([one.mirrored for one in samples]))
    yield _value(AdviceCode.GLOSSY_FLOOR, mirrored, p.OFTEN_MIRRORED, "%")
    yield _value(AdviceCode.CUT_OFF, 100.0 * float(np.mean([one.cut for one in samples])), p.OFTEN_CUT, "%")
    yield _value(AdviceCode.PEOPLE, 100.0 * float(np.mean([one.people for one in samples])), p.OFTEN_PEOPLE, "%")
    yield _value(AdviceCode.UNCOVERED, 100.0 * float(np.mean([one.uncovered for one in samples])), p.OFTEN_UNCOVERED, "%")
    yield _value(AdviceCode.SMALL, float(np.median([one.height for one in samples])), found.small_px, "px")


def _of_light(found: Measured) -> Iterator[CameraFault]:
    middle = found.fast[-1][0] - p.ADVICE_FLICKER_S / 2.0 if found.fast else 0.0
    halves = [[one for one in found.fast if (one[0] < middle) == early] for early in (True, False)]
    colours = [[(time_s, cells[..., k]) for time_s, cells in found.slow] for k in range(3)]
    changes = [light([time_s for time_s, _ in one], [cells for _, cells in one]) for one in (*colours, *halves)]
    drifts = [100.0 * one.drift for one in changes[: len(colours)] if one is not None]
    if drifts:
        yield _value(AdviceCode.LIGHT_DRIFT, float(np.median(drifts)), p.HIGH_DRIFT, "%")
        yield _value(AdviceCode.WHITE_BALANCE, max(drifts) - min(drifts), p.HIGH_COLOUR_DRIFT, "%")
    flickers = [one.flicker for one in changes[len(colours) :] if one is not None]
    if len(flickers) == len(halves):  # a lamp that is switched changes one half
        yield _value(AdviceCode.FLICKER, 100.0 * min(flickers), p.HIGH_FLICKER, "%")
    if found.exposure is not None:
        yield _value(AdviceCode.DARK, found.exposure.mean, p.LOW_BRIGHTNESS, "levels")
        yield _value(AdviceCode.SATURATED, 100.0 * found.exposure.saturated, p.MUCH_SATURATED, "%")


def _of_lens(found: Measured) -> Iterator[CameraFault]:
    if found.edge_px is not None:
        yield _value(AdviceCode.FOCUS, found.edge_px, max(p.WIDE_EDGES_MIN_PX, p.WIDE_EDGES * found.rows), "px")
    blur = blur_percent(found.blurs)
    if blur is not None:
        yield _value(AdviceCode.MOTION_BLUR, blur, p.LONG_BLUR, "%")
