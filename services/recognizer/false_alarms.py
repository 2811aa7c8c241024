"""False postures of a model on a background, and thresholds for a rate of them."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincinv

from zenocap.common.arrays import Floats

CONFIDENCE = 0.95  # of the upper limit of a rate


@dataclass(frozen=True, eq=False)
class FalseAlarms:
    """Windows of a background that a model would answer with a posture.

    hours: duration of the background.  shares: (m,) share of the votes of each such window for its posture, rising, with
    the thresholds before.  least: share to which lower thresholds were raised then; 0: none.
    """

    hours: float
    shares: Floats
    least: float = 0.0

    @property
    def count(self) -> int:
        """Number of false postures that remain."""
        return int((self.shares >= self.least).sum())

    @property
    def per_hour(self) -> float:
        """Their rate."""
        return self.count / self.hours

    @property
    def most_per_hour(self) -> float:
        """Upper limit of the rate with CONFIDENCE, see `upper_rate`."""
        return upper_rate(self.count, self.hours)

    def __str__(self) -> str:
        rates = f"{self.per_hour:.3g} an hour, with 95 % confidence at most {self.most_per_hour:.3g}"
        return f"{self.count} false in {60 * self.hours:.1f} min of background: {rates}"


def upper_rate(count: int, hours: float) -> float:
    """Upper limit of the rate (1/h), with CONFIDENCE, of independent events of which `count` were found in `hours`.

    Of a Poisson distribution; without an event it is 3.0 / hours, the rule of three.
    """
    return float(gammaincinv(count + 1, CONFIDENCE)) / hours


def hours_needed(per_hour: float) -> float:
    """Duration (h) of a background without a false posture that shows a rate with CONFIDENCE."""
    return upper_rate(0, 1.0) / per_hour


def short_background(alarms: FalseAlarms | None, per_hour: float | None) -> str | None:
    """Warning of a background too short to show a rate of false postures; None where it shows it, or without a rate."""
    if per_hour is None or alarms is None or alarms.most_per_hour <= per_hour:
        return None
    needed = f"needed for {per_hour:g} an hour: {60 * hours_needed(per_hour):.0f} min without a false one, or more"
    return f"the background does not show {per_hour:g} an hour: {alarms}; {needed}"


def least_share(shares: Floats, hours: float, per_hour: float, step: float) -> float:
    """Least share of votes with which the background shows a rate of at most `per_hour`, see `upper_rate`.

    With `per_hour` times `hours` false postures left in the background, more than half of the models would have a larger
    rate with other people.  A background too short to show the rate is left without any, except those with all votes, up to
    that number.  0 where all may remain; above 1 where more have all votes.
    shares: see FalseAlarms.  step: least difference of two shares.
    """
    falling = np.sort(shares)[::-1]
    limits = gammaincinv(np.arange(len(falling) + 1) + 1, CONFIDENCE) / hours
    unanimous = int((falling > 1.0 - 0.5 * step).sum())
    allowed = max(0, int((limits <= per_hour).sum()) - 1, unanimous if unanimous <= per_hour * hours + 1e-9 else 0)
    return 0.0 if len(falling) <= allowed else float(falling[allowed]) + 0.5 * step
