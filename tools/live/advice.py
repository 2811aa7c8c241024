"""The measures of a camera as rows for people: value, whether it is good, and what to do where it is not."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import msgspec

from zenocap.common.vision.image_measures import Exposure, Light
from zenocap.tools.live.parameters import (
    BRIGHT_MEAN,
    BRIGHTNESS_S,
    DARK_MEAN,
    HIGH_DRIFT,
    HIGH_FLICKER,
    HIGH_JITTER,
    HIGH_NOISE,
    LOW_RATE,
    MUCH_BLACK,
    MUCH_SATURATED,
    SOFT,
)

Verdict = Literal["good", "bad", "wait"]


@dataclass(frozen=True)
class Measures:
    """Measures of one camera; None where one is not known yet.

    rate, requested_rate: frames/s.  jitter_s: 95 % of the intervals are this near the median one.  focus: see
    `measures.focus`; best_focus: the largest so far.  noise: standard deviation, levels.
    """

    rate: float | None
    requested_rate: float
    jitter_s: float | None
    focus: float | None
    best_focus: float
    exposure: Exposure | None
    noise: float | None
    light: Light | None

    @property
    def sharpness(self) -> float | None:
        """Focus measure by the best one seen, 0 to 1."""
        return None if self.focus is None or self.best_focus <= 0 else min(1.0, self.focus / self.best_focus)


class Row(msgspec.Struct, frozen=True):
    """A measure on the page.  share: of the best, 0 to 1, for a bar; None without one.  advice: "" for a good one."""

    key: str
    name: str
    value: str
    verdict: Verdict
    advice: str = ""
    share: float | None = None


def rows(found: Measures) -> list[Row]:
    """All measures, in the order of the page."""
    makers: tuple[Callable[[Measures], Row], ...] = (_rate, _jitter, _focus, _exposure, _noise, _drift, _flicker)
    return [make(found) for make in makers]


def _waiting(key: str, name: str) -> Row:
    return Row(key, name, "–", "wait")


def _row(key: str, name: str, value: str, advice: str, share: float | None = None) -> Row:
    return Row(key, name, value, "bad" if advice else "good", advice, share)


def _rate(found: Measures) -> Row:
    if found.rate is None:
        return _waiting("rate", "Rate")
    advice = ""
    if found.rate < LOW_RATE * found.requested_rate:
        advice = (
            "Fewer images than requested: a longer exposure in the dark lowers the rate, so add light; or use a smaller "
            "size, MJPG, or another USB port."
        )
    return _row("rate", "Rate", f"{found.rate:.1f} of {found.requested_rate:.4g} /s", advice)


def _jitter(found: Measures) -> Row:
    if found.jitter_s is None:
        return _waiting("jitter", "Jitter")
    advice = ""
    if found.rate and found.jitter_s > HIGH_JITTER / found.rate:
        advice = "Images come unevenly: give the camera a USB port of its own, or the stream a cable instead of Wi-Fi."
    return _row("jitter", "Jitter", f"{1000 * found.jitter_s:.1f} ms", advice)


def _focus(found: Measures) -> Row:
    share = found.sharpness
    if share is None:
        return _waiting("focus", "Focus")
    advice = ""
    if share < SOFT:
        advice = (
            "It was sharper before: turn the focus until the bar is full, then fix it. If the scene changed: measure anew."
        )
    return _row("focus", "Focus", f"{share:.0%} of best", advice, share)


def _exposure(found: Measures) -> Row:
    one = found.exposure
    if one is None:
        return _waiting("exposure", "Exposure")
    advice = ""
    if one.saturated > MUCH_SATURATED:
        advice = "Parts are saturated: shorten the exposure, lower the gain, or keep windows and lamps out of the picture."
    elif one.mean > BRIGHT_MEAN:
        advice = "Too bright: shorten the exposure or lower the gain."
    elif one.mean < DARK_MEAN:
        advice = "Too dark: add light; a longer exposure blurs motion, more gain adds noise."
    elif one.black > MUCH_BLACK:
        advice = "Large parts are black: add light from the side of the camera."
    value = f"mean {one.mean:.0f}, saturated {one.saturated:.0%}, black {one.black:.0%}"
    return _row("exposure", "Exposure", value, advice)


def _noise(found: Measures) -> Row:
    if found.noise is None or math.isnan(found.noise):
        return _waiting("noise", "Noise")
    advice = "Noisy: add light and lower the gain." if found.noise > HIGH_NOISE else ""
    return _row("noise", "Noise", f"{found.noise:.1f} levels", advice)


def _drift(found: Measures) -> Row:
    if found.light is None:
        return _waiting("drift", "Drift")
    advice = ""
    if abs(found.light.drift) > HIGH_DRIFT:
        advice = (
            "The brightness changes: fix exposure and gain, switch off the camera's automatic modes, keep daylight out."
        )
    return _row("drift", "Drift", f"{found.light.drift:+.1%} in {BRIGHTNESS_S:.0f} s", advice)


def _flicker(found: Measures) -> Row:
    if found.light is None:
        return _waiting("flicker", "Flicker")
    advice = ""
    if found.light.flicker > HIGH_FLICKER:
        advice = (
            "The light flickers: set the exposure to a multiple of 1/100 s (mains of 50 Hz) or 1/120 s (60 Hz), or use "
            "other lamps."
        )
    return _row("flicker", "Flicker", f"{found.light.flicker:.1%}", advice)
