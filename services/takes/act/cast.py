"""Who does which posture how often, and what the takes of it are called."""

from collections.abc import Iterable
from dataclasses import dataclass

from common.actor.person import person
from common.actor.script import Script, posture_take
from common.actor.style import POSTURES

CAST = 12  # people in [Two-view 5]
REPETITIONS = 2


@dataclass(frozen=True)
class Act:
    """One repetition of a posture by one person.  person: its seed.  repetition: from 0."""

    person: int
    posture: str
    repetition: int

    @property
    def name(self) -> str:
        return f"{self.person}-{self.posture}-{self.repetition}"

    @property
    def room(self) -> int:
        """Seed of the room, the light and the noise: no two takes are filmed in the same."""
        return 1000 * self.person + 10 * POSTURES.index(self.posture) + self.repetition

    def script(self) -> Script:
        """Empty scene, initial posture, arms down, and then the posture, from `motion_from_s` to `duration_s`."""
        return posture_take(person(self.person), self.posture, self.repetition)


def people(people_seed: int, count: int = CAST) -> range:
    """Seeds of `count` people; up to twelve of one `people_seed` are others than those of another."""
    return range(CAST * people_seed, CAST * people_seed + count)


def acts(who: Iterable[int], postures: Iterable[str] = POSTURES, repetitions: int = REPETITIONS) -> list[Act]:
    """Every repetition of every posture by everybody.  Raises ValueError for a posture not in POSTURES."""
    wanted = tuple(dict.fromkeys(postures))
    for posture in wanted:
        if posture not in POSTURES:
            raise ValueError(f"posture {posture!r}: allowed: {', '.join(POSTURES)}")
    return [Act(seed, posture, k) for seed in who for posture in wanted for k in range(repetitions)]
