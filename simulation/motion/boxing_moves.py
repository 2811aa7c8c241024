"""Sequence of punches, slips and shuffles of a boxer, and the boxer's style, by seed."""

from dataclasses import dataclass

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import LEFT, RIGHT, minimum_jerk

ENTER_S = 0.9  # duration from standing into the guard, and back
AREA_M = 0.45  # largest distance of the boxer from the start
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
    """One punch, slip or shuffle.  size: amplitude relative to the usual one.

    aim: (2,) of a punch, offset left and up from the usual target, metres; of a shuffle, displacement (x, z).
    """

    name: str
    start_s: float
    duration_s: float
    size: float
    aim: tuple[float, float]

    def pulse(self, time_s: float, peak: float) -> float:
        """Pulse: 0 before and after the move, `size` at the fraction `peak` of the duration."""
        u = (time_s - self.start_s) / self.duration_s
        return self.size * minimum_jerk(u / peak) * (1.0 - minimum_jerk((u - peak) / (1.0 - peak)))

    def done(self, time_s: float, start: float, end: float) -> float:
        """Progress from 0 to 1 between two fractions of the duration."""
        return minimum_jerk(((time_s - self.start_s) / self.duration_s - start) / (end - start))


@dataclass(frozen=True)
class BoxingStyle:
    """Style of a boxer: lead side, depth of the stance (leg lengths), bounces per second, height and width of the guard."""

    lead: int
    depth: float
    turned: float
    bounce_hz: float
    phase: float
    guard: tuple[float, float, float]
    arms: tuple[float, float]


def boxing_style(seed: int) -> BoxingStyle:
    """The style of the person with this seed, 0 or more."""
    rng = np.random.default_rng([0x33, seed])
    return BoxingStyle(
        lead=LEFT if rng.uniform() < 0.85 else RIGHT,
        depth=float(rng.uniform(0.05, 0.09)),
        turned=float(np.radians(rng.uniform(28.0, 45.0))),
        bounce_hz=float(rng.uniform(1.3, 2.0)),
        phase=float(rng.uniform(0.0, 2.0 * np.pi)),
        guard=(float(rng.uniform(0.06, 0.12)), float(rng.uniform(-0.04, 0.06)), float(rng.uniform(0.24, 0.32))),
        arms=(float(rng.uniform(0.25, 0.6)), float(rng.uniform(0.9, 1.1))),
    )


def boxing_moves(person: Person, duration_s: float, seed: int) -> list[Move]:
    """Moves in the order of their start, within the duration; the last one returns to the start."""
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
