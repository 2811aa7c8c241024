"""Measures of a camera as rows for people: value, whether it is good, and what to do.

Limits and texts of the faults that a running viewer reports too are the viewer's.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

import msgspec

from zenocap.common.camera_advice import WORDINGS
from zenocap.common.messages import AdviceCode
from zenocap.common.vision.image_measures import Exposure, Light
from zenocap.services.viewer.parameters import ADVICE_LIGHT_S, HIGH_DRIFT, HIGH_FLICKER, LOW_BRIGHTNESS, MUCH_SATURATED
from zenocap.tools.setup.page.parameters import BRIGHT_MEAN, HIGH_JITTER, HIGH_NOISE, LOW_RATE, MUCH_BLACK, SOFT

Verdict = Literal["good", "bad", "wait"]
T = TypeVar("T")
SLOW = (
    "Fewer images than requested: a longer exposure in the dark lowers the rate, so add light; or use a smaller size, "
    "MJPG, or another USB port."
)
UNEVEN = "Images come unevenly: give the camera a USB port of its own, or the stream a cable instead of Wi-Fi."
SOFTER = "It was sharper before: turn the focus until the bar is full, then fix it. If the scene changed: measure anew."
BRIGHT = "Too bright: shorten the exposure or lower the gain."
BLACK = "Large parts are black: add light from the side of the camera."
NOISY = "Noisy: add light and lower the gain."


@dataclass(frozen=True)
class Measures:
    """Measures of one camera; None where one is not known yet.

    rate, requested_rate: frames/s.  jitter_s: 95 % of the intervals are this near the median one.  focus: see
    `image_measures.focus`; best_focus: the largest so far.  noise: standard deviation, levels.
    """

    rate: float | None
    requested_rate: float
    jitter_s: float | None
    best_focus: float
    focus: float | None = None
    exposure: Exposure | None = None
    noise: float | None = None
    light: Light | None = None

    @property
    def sharpness(self) -> float | None:
        """Focus measure by the best one seen, 0 to 1."""
        return None if self.focus is None or self.best_focus <= 0 else min(1.0, self.focus / self.best_focus)


class MeasureRow(msgspec.Struct, frozen=True):
    """A measure on the page.  share: of the best, 0 to 1, for a bar; None without one.  advice: "" for a good one."""

    key: str
    name: str
    value: str
    verdict: Verdict
    advice: str = ""
    share: float | None = None


def rows(found: Measures) -> list[MeasureRow]:
    """All measures, in the order of the page."""
    rate, sharpness, light = found.rate, found.sharpness, found.light
    noise = None if found.noise is None or math.isnan(found.noise) else found.noise
    uneven_s = HIGH_JITTER / rate if rate else math.inf
    return [
        _row("rate", "Rate", rate, lambda its: f"{its:.1f} of {found.requested_rate:.4g} /s",
             lambda its: SLOW if its < LOW_RATE * found.requested_rate else ""),
        _row("jitter", "Jitter", found.jitter_s, lambda its: f"{1000 * its:.1f} ms",
             lambda its: UNEVEN if its > uneven_s else ""),
        _row("focus", "Focus", sharpness, lambda its: f"{its:.0%} of best",
             lambda its: SOFTER if its < SOFT else "", sharpness),
        _row("exposure", "Exposure", found.exposure, _exposure_text, _exposure_advice),
        _row("noise", "Noise", noise, lambda its: f"{its:.1f} levels", lambda its: NOISY if its > HIGH_NOISE else ""),
        _row("drift", "Drift", light, lambda its: f"{its.drift:+.1%} in {ADVICE_LIGHT_S:.0f} s",
             lambda its: _advice("The light drifts", AdviceCode.LIGHT_DRIFT)
             if 100.0 * abs(its.drift) > HIGH_DRIFT else ""),
        _row("flicker", "Flicker", light, lambda its: f"{its.flicker:.1%}",
             lambda its: _advice("The light flickers", AdviceCode.FLICKER) if 100.0 * its.flicker > HIGH_FLICKER else ""),
    ]  # fmt: skip


def _row(
    key: str, name: str, known: T | None, text: Callable[[T], str], advise: Callable[[T], str], share: float | None = None
) -> MeasureRow:
    if known is None:
        return MeasureRow(key, name, "–", "wait")
    advice = advise(known)
    return MeasureRow(key, name, text(known), "bad" if advice else "good", advice, share)


def _advice(fault: str, code: AdviceCode) -> str:
    return f"{fault}: {WORDINGS[code].change}."


def _exposure_text(one: Exposure) -> str:
    return f"mean {one.mean:.0f}, saturated {one.saturated:.0%}, black {one.black:.0%}"


def _exposure_advice(one: Exposure) -> str:
    if 100.0 * one.saturated > MUCH_SATURATED:
        return _advice("Parts are saturated", AdviceCode.SATURATED)
    if one.mean > BRIGHT_MEAN:
        return BRIGHT
    if one.mean < LOW_BRIGHTNESS:
        return _advice("Too dark", AdviceCode.DARK)
    return BLACK if one.black > MUCH_BLACK else ""
