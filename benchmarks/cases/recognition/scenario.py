"""Sessions of postures with pauses and untrained movements, and scores of a stream's answers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.simulation.body.person import person
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import RETURNING, MotionTimeline, session_timeline

MINUTE_S = 60.0
UNKNOWN_SHARE = 0.35  # of the movements
NO_PAUSE_SHARE = 0.15  # fraction that follows the previous one without a pause
PAUSES_S = (0.4, 2.5)
OVERLAP = 0.5  # minimum overlap of answer and event, as a fraction of the shorter one
REPETITION_FROM = 10  # other repetitions than in the takes of the same people


@dataclass(frozen=True)
class Event:
    """A movement from start_s to end_s, seconds from frame 0.  label: None for other movements than postures.

    at_s: time of an answer.
    """

    label: str | None
    start_s: float
    end_s: float
    at_s: float = 0.0


@dataclass(frozen=True)
class EventScore:
    """right: answers that fit an event of their posture.  wrong: other answers with a posture.  events: true postures.

    unknown: movements that are no posture.  unknown_wrong: those with a wrong answer.  delays_s: from the true end to each
    right answer.
    """

    right: int
    wrong: int
    events: int
    unknown: int
    unknown_wrong: int
    delays_s: tuple[float, ...]
    minutes: float


def session_of(seed: int, minutes: float) -> MotionTimeline:
    """A session of about `minutes` of a person.  seed: of the person and the sequence of movements."""
    rng = np.random.default_rng([0x51, seed])
    subject = person(seed)
    movements: list[tuple[str, int]] = []
    pauses_s: list[float] = []
    while True:
        script = session_timeline(subject, movements, pauses_s, seed)
        if script.duration_s >= minutes * MINUTE_S:
            return script
        for _ in range(4):
            names = ACTIVITIES if rng.uniform() < UNKNOWN_SHARE else POSTURES
            movements.append((str(rng.choice(names)), REPETITION_FROM + len(movements)))
            pauses_s.append(0.0 if rng.uniform() < NO_PAUSE_SHARE else float(rng.uniform(*PAUSES_S)))


def events_of(script: MotionTimeline) -> list[Event]:
    """Events of a session after the T-pose; the label of a posture is its name."""
    found = []
    for segment in script.segments:
        if segment.name in (*POSTURES, *ACTIVITIES, RETURNING):
            label = segment.name if segment.name in POSTURES else None
            found.append(Event(label, segment.start_s, segment.end_s))
    return found


def score_of(events: Sequence[Event], answers: Sequence[Event], minutes: float) -> EventScore:
    """Score of answers.  An answer fits at most one event, an event has at most one right answer."""
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
    return EventScore(
        right=len(delays),
        wrong=len(wrong),
        events=sum(event.label is not None for event in events),
        unknown=len(unknown),
        unknown_wrong=sum(any(overlaps(event, answer) for answer in wrong) for event in unknown),
        delays_s=tuple(delays),
        minutes=minutes,
    )


def sum_of(scores: Sequence[EventScore]) -> EventScore:
    """Sum of the scores of all sessions."""
    counts = {
        name: sum(getattr(score, name) for score in scores)
        for name in ("right", "wrong", "events", "unknown", "unknown_wrong")
    }
    delays = tuple(delay for score in scores for delay in score.delays_s)
    return EventScore(**counts, delays_s=delays, minutes=sum(score.minutes for score in scores))


def overlaps(event: Event, answer: Event) -> bool:
    shorter = min(event.end_s - event.start_s, answer.end_s - answer.start_s)
    return shared_s(event, answer) >= OVERLAP * shorter > 0.0


def shared_s(event: Event, answer: Event) -> float:
    return max(0.0, min(event.end_s, answer.end_s) - max(event.start_s, answer.start_s))
