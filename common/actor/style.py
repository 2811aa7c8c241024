"""The names of the fifteen postures, and how a person does one of them this time."""

from dataclasses import dataclass

import numpy as np

from common.actor.person import Person
from common.actor.pose import ease

POSTURES: tuple[str, ...] = (
    "march",
    "turn-and-walk",
    "raise-right-arm",
    "raise-left-arm",
    "raise-both-arms",
    "raise-both-arms-bent",
    "swing-right-arm",
    "swing-left-arm",
    "swing-both-arms",
    "squat",
    "squat-arms-sideways",
    "squat-arms-forward",
    "kick-right",
    "kick-left",
    "kick-right-arms-sideways",
)

DURATION_S = 2.7


@dataclass(frozen=True)
class Style:
    """How one repetition is done.

    duration_s: of the whole.  onset, hold, fall: shares of it when the main movement begins, arrives and returns.
    vigour: factor on amplitudes.  habit: this person's own in [-1, 1], the same for every repetition of a posture.
    chance: (8,) this repetition's own, standard normal and bounded by 2.
    """

    duration_s: float
    onset: float
    hold: float
    fall: float
    vigour: float
    habit: float
    chance: tuple[float, ...]

    def pulse(self, time_s: float, ahead: float = 0.0) -> float:
        """0 at both ends and 1 between arrival and return; `ahead` shifts it by a share of the duration."""
        u = time_s / self.duration_s + ahead
        rise = ease((u - self.onset) / (self.hold - self.onset))
        return rise * (1.0 - ease((u - self.fall) / (0.96 + ahead - self.fall)))


def repetition(person: Person, name: str, seed: int) -> Style:
    """The style of a person's repetition `seed` (0 or more) of a posture."""
    number = POSTURES.index(name)
    habit = float(np.random.default_rng([0x21, person.seed, number]).uniform(-1.0, 1.0))
    rng = np.random.default_rng([0x22, person.seed, number, seed])
    chance = tuple(float(c) for c in np.clip(rng.normal(0.0, 1.0, 8), -2.0, 2.0))
    duration_s = DURATION_S / person.manner.tempo * float(rng.uniform(0.94, 1.06))
    onset = float(rng.uniform(0.02, 0.08))
    hold = onset + float(rng.uniform(0.36, 0.44))
    fall = hold + float(rng.uniform(0.02, 0.10))
    vigour = person.manner.vigour * (1.0 + 0.04 * chance[7])
    return Style(duration_s, onset, hold, fall, vigour, habit, chance)
