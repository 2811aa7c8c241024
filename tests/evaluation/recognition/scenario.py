"""Sessions of postures with pauses and movements that nobody taught, and how well a stream's answers fit them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.actor.everyday import EVERYDAY
from common.actor.person import person
from common.actor.script import RETURNING, Script, session
from common.actor.style import POSTURES

MINUTE_S = 60.0
UNKNOWN_SHARE = 0.35  # of the movements
AT_ONCE = 0.15  # share that follows the one before without a pause
PAUSES_S = (0.4, 2.5)
OVERLAP = 0.5  # of the shorter one, for an answer to be about an event
REPETITION_FROM = 10  # others than in the takes of the same people


@dataclass(frozen=True)
class Event:
    """A movement from start_s to end_s, seconds from frame 0.  label: None of what is no posture.

    at_s: of an answer, when it was given.  name: what it really is.
    """

    label: str | None
    start_s: float
    end_s: float
    at_s: float = 0.0
    name: str = ""


@dataclass(frozen=True)
class Score:
    """right: answers that fit an event of their posture.  wrong: answers of a posture that do not.  events: true ones.

    unknown: movements that are no posture.  taken: of these the ones that a wrong answer is about.  known_wrong: postures
    that were answered as another one.  delays_s: from the true end to the answer, of the right ones.
    """

    right: int
    wrong: int
    events: int
    unknown: int
    taken: int
    known_wrong: int
    delays_s: tuple[float, ...]
    minutes: float


def session_of(seed: int, minutes: float) -> Script:
    """About `minutes` of a person.  seed: who, and what happens."""
    rng = np.random.default_rng([0x51, seed])
    somebody = person(seed)
    movements: list[tuple[str, int]] = []
    pauses_s: list[float] = []
    while True:
        script = session(somebody, movements, pauses_s, seed)
        if script.duration_s >= minutes * MINUTE_S:
            return script
        for _ in range(4):
            names = EVERYDAY if rng.uniform() < UNKNOWN_SHARE else POSTURES
            movements.append((str(rng.choice(names)), REPETITION_FROM + len(movements)))
            pauses_s.append(0.0 if rng.uniform() < AT_ONCE else float(rng.uniform(*PAUSES_S)))


def events_of(script: Script) -> list[Event]:
    """What happens in a session after the initial posture; a posture has its name as its label."""
    found = []
    for segment in script.segments:
        if segment.name in (*POSTURES, *EVERYDAY, RETURNING):
            label = segment.name if segment.name in POSTURES else None
            found.append(Event(label, segment.start_s, segment.end_s, name=segment.name))
    return found


def score_of(events: Sequence[Event], answers: Sequence[Event], minutes: float) -> Score:
    """Every answer is about at most one event, every event has at most one right answer."""
    free = [event for event in events if event.label is not None]
    delays, wrong = [], []
    for answer in answers:
        if answer.label is None:
            continue
        fits = [event for event in free if event.label == answer.label and overlaps(event, answer)]
        if fits:
            best = max(fits, key=lambda event: shared_s(event, answer))
            free.remove(best)
            delays.append(answer.at_s - best.end_s)
        else:
            wrong.append(answer)
    unknown = [event for event in events if event.label is None]
    return Score(
        right=len(delays),
        wrong=len(wrong),
        events=sum(event.label is not None for event in events),
        unknown=len(unknown),
        taken=sum(any(overlaps(event, answer) for answer in wrong) for event in unknown),
        known_wrong=sum(any(overlaps(event, answer) for answer in wrong) for event in free),
        delays_s=tuple(delays),
        minutes=minutes,
    )


def together(scores: Sequence[Score]) -> Score:
    """Of all sessions as one."""
    counts = {
        name: sum(getattr(score, name) for score in scores)
        for name in ("right", "wrong", "events", "unknown", "taken", "known_wrong")
    }
    delays = tuple(delay for score in scores for delay in score.delays_s)
    return Score(**counts, delays_s=delays, minutes=sum(score.minutes for score in scores))


def overlaps(event: Event, answer: Event) -> bool:
    shorter = min(event.end_s - event.start_s, answer.end_s - answer.start_s)
    return shared_s(event, answer) >= OVERLAP * shorter > 0.0


def shared_s(event: Event, answer: Event) -> float:
    return max(0.0, min(event.end_s, answer.end_s) - max(event.start_s, answer.start_s))
