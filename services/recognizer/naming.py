"""Names for the candidates of a take: what a model guesses, what a manifest has already, and rows for what was named."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from services.recognizer.candidates import Candidate
from services.recognizer.features import KINDS
from services.recognizer.manifest import Row
from services.recognizer.model import PostureModel, judge
from services.recognizer.reading import features_in, stretch
from services.recognizer.sequences import resampled


@dataclass(frozen=True)
class Guess:
    """label: of the likeliest posture.  known: the model says that it is one.  margin: log-likelihood over the second."""

    label: str
    known: bool
    margin: float

    def __str__(self) -> str:
        return self.label if self.known else f"{self.label}?"


def guesses_of(model: PostureModel, source: Path, candidates: Sequence[Candidate]) -> list[Guess | None]:
    """What a model takes each for; None for one with too few frames.  Raises FormatError and TakeError."""
    kind = next(kind for kind in KINDS if kind == model.features)
    motion = features_in(source, kind)
    guesses: list[Guess | None] = []
    for one in candidates:
        try:
            features = stretch(motion, one.start_s, one.end_s)
        except ValueError:
            guesses.append(None)
            continue
        judgement = judge(model, resampled(features, motion.rate, model.rate))
        guesses.append(Guess(model.labels[judgement.best], judgement.known, judgement.margin))
    return guesses


def is_named(rows: Sequence[Row], source: Path, one: Candidate) -> bool:
    """Whether more than half of it is in a row of the same source."""
    for row in rows:
        if row.source.resolve() == source.resolve():
            end = one.end_s if row.end is None else row.end
            if min(one.end_s, end) - max(one.start_s, row.start or 0.0) > 0.5 * (one.end_s - one.start_s):
                return True
    return False


def with_named(rows: Sequence[Row], source: Path, person: str, named: Sequence[tuple[Candidate, str]]) -> list[Row]:
    """Rows and one more for each candidate with its posture; repetitions of a posture by a person are counted on."""
    made = list(rows)
    for one, posture in named:
        done = sum(row.posture == posture and row.person == person for row in made)
        made.append(Row(0, source, round(one.start_s, 3), round(one.end_s, 3), posture, person, str(done + 1)))
    return made
