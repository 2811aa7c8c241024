"""What a boxer does when: the order of punches, slips and shuffles, drawn by seed, and the boxer's own manner."""

from dataclasses import dataclass

import numpy as np

from common.actor.person import Person
from common.actor.pose import LEFT, RIGHT, ease

ENTER_S = 0.9  # from standing into the guard, and back
AREA_M = 0.45  # the boxer stays this near to where they began
PUNCHES = ("jab", "cross", "lead-hook", "rear-hook", "lead-uppercut", "rear-uppercut")
COMBINATIONS = (
    ("jab",),
    ("jab", "jab"),
    ("jab", "cross"),
    ("cross",),
    ("jab", "cross", "lead-hook"),
    ("lead-hook",),
    ("rear-uppercut", "lead-hook"),
    ("cross", "lead-uppercut", "rear-hook"),
)


@dataclass(frozen=True)
class Move:
    """One punch, slip or shuffle: what it is, when it starts, how long it takes, how far it goes (1 is usual), and
    aim (2,): to the left and up of the usual goal for punches, metres; the way (x, z) of a shuffle."""

    name: str
    start_s: float
    duration_s: float
    size: float
    aim: tuple[float, float]

    def pulse(self, time_s: float, peak: float) -> float:
        """0 before and after, 1 at the share `peak` of the duration."""
        u = (time_s - self.start_s) / self.duration_s
        return self.size * ease(u / peak) * (1.0 - ease((u - peak) / (1.0 - peak)))

    def done(self, time_s: float, start: float, end: float) -> float:
        """Course from 0 to 1 between two shares of the duration."""
        return ease(((time_s - self.start_s) / self.duration_s - start) / (end - start))


@dataclass(frozen=True)
class BoxingManner:
    """A boxer's own: lead side, depth of the stance in leg lengths, bounces per second, height and width of the guard."""

    lead: int
    depth: float
    turned: float
    bounce_hz: float
    phase: float
    guard: tuple[float, float, float]
    arms: tuple[float, float]


def boxing_manner(seed: int) -> BoxingManner:
    """The manner of the person of a seed, 0 or more."""
    rng = np.random.default_rng([0x33, seed])
    return BoxingManner(
        lead=LEFT if rng.uniform() < 0.85 else RIGHT,
        depth=float(rng.uniform(0.05, 0.09)),
        turned=float(np.radians(rng.uniform(28.0, 45.0))),
        bounce_hz=float(rng.uniform(1.3, 2.0)),
        phase=float(rng.uniform(0.0, 2.0 * np.pi)),
        guard=(float(rng.uniform(0.06, 0.12)), float(rng.uniform(-0.04, 0.06)), float(rng.uniform(0.24, 0.32))),
        arms=(float(rng.uniform(0.25, 0.6)), float(rng.uniform(0.9, 1.1))),
    )


def boxing_moves(person: Person, duration_s: float, seed: int) -> list[Move]:
    """In order of their beginning, within the duration; the last leads back to where the boxer began."""
    rng = np.random.default_rng([0x32, person.seed, seed])
    moves: list[Move] = []
    tempo = person.manner.tempo
    time_s, at = ENTER_S + 0.3, np.zeros(2)
    while True:
        kind = float(rng.uniform())
        if kind < 0.60:
            names = COMBINATIONS[int(rng.integers(len(COMBINATIONS)))]
        elif kind < 0.78:
            names = ("slip-left",) if rng.uniform() < 0.5 else ("slip-right",)
        else:
            names = ("shuffle",)
        for name in names:
            way = (float(rng.normal(0.0, 0.05)), float(rng.normal(0.0, 0.08)))
            lasts = {"shuffle": 0.50, "slip-left": 0.75, "slip-right": 0.75}.get(name, 0.52 if name == "jab" else 0.62)
            lasts = lasts / tempo * float(rng.uniform(0.88, 1.18))
            if name == "shuffle":
                goal = rng.uniform(-AREA_M, AREA_M, 2)
                step = goal - at
                step *= min(1.0, 0.32 / max(float(np.linalg.norm(step)), 1e-6))
                at, way = at + step, (float(step[0]), float(step[1]))
            if time_s + lasts > duration_s - ENTER_S - 1.2:
                if at.any():
                    moves.append(Move("shuffle", duration_s - ENTER_S - 1.0, 0.7, 1.0, (float(-at[0]), float(-at[1]))))
                return moves
            size = float(rng.uniform(0.85, 1.12)) * person.manner.vigour if name != "shuffle" else 1.0
            moves.append(Move(name, time_s, lasts, size, way))
            time_s += lasts * (0.72 if name in PUNCHES else 1.0)  # the next punch starts while this one returns
        time_s += float(rng.exponential(0.35)) / tempo
