"""Names of the fifteen postures, and the style of one repetition by a person."""

from dataclasses import dataclass

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import minimum_jerk

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
class PostureStyle:
    """Style of one repetition.

    duration_s: of the repetition.  onset, hold, fall: fractions of it at which the main movement begins, arrives, returns.
    vigour: factor on amplitudes.  habit: variation by person, in [-1, 1], the same for every repetition of a posture.
    chance: (8,) variation by repetition, standard normal, clipped to [-2, 2].
    """

    duration_s: float
    onset: float
    hold: float
    fall: float
    vigour: float
    habit: float
    chance: tuple[float, ...]

    def pulse(self, time_s: float, ahead: float = 0.0) -> float:
        """Pulse: 0 at both ends, 1 between arrival and return; `ahead` shifts it by a fraction of the duration."""
        u = time_s / self.duration_s + ahead
        rise = minimum_jerk((u - self.onset) / (self.hold - self.onset))
        return rise * (1.0 - minimum_jerk((u - self.fall) / (0.96 + ahead - self.fall)))


def posture_style(person: Person, name: str, seed: int) -> PostureStyle:
    """Style of repetition `seed` (0 or more) of a posture by a person."""
    number = POSTURES.index(name)
    habit = float(np.random.default_rng([0x21, person.seed, number]).uniform(-1.0, 1.0))
    rng = np.random.default_rng([0x22, person.seed, number, seed])
    chance = tuple(float(c) for c in np.clip(rng.normal(0.0, 1.0, 8), -2.0, 2.0))
    duration_s = DURATION_S / person.manner.tempo * float(rng.uniform(0.94, 1.06))
    onset = float(rng.uniform(0.02, 0.08))
    hold = onset + float(rng.uniform(0.36, 0.44))
    fall = hold + float(rng.uniform(0.02, 0.10))
    vigour = person.manner.vigour * (1.0 + 0.04 * chance[7])
    return PostureStyle(duration_s, onset, hold, fall, vigour, habit, chance)
