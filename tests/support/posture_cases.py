"""Synthetic postures: from rest each raises and lowers some of the ten features."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.motion_rows import ANGLES, HEADING, WIDTH
from zenocap.services.recognizer.training.examples import Example, TrainingSettings, prepare
from zenocap.services.recognizer.training.train import train_models

RATE = 15.0
LABELS = ("wave", "kick", "bow")
MOVED = {"wave": (0, 1), "kick": (6,), "bow": (6, 8), "stretch": (0, 2, 4)}
FAST = TrainingSettings(classifier="paper", symbols=24, folds=2)
FAST_FOREST = TrainingSettings(symbols=24, folds=2)


def movement(label: str, person: int, repetition: int, seconds: float = 2.0, rate: float = RATE) -> Floats:
    """(T, WIDTH) rows: ten angles, radians, of a body that stays where it is."""
    rng = np.random.default_rng((sorted(MOVED).index(label), person, repetition))
    amplitude = np.random.default_rng((99, person)).uniform(0.8, 1.2)
    count = int(seconds * rate * rng.uniform(0.9, 1.1))
    features = np.tile(np.linspace(-0.5, 0.5, len(NAMES)), (count, 1))
    pulse = np.sin(np.pi * np.arange(count) / count) ** 2
    for column in MOVED[label]:
        features[:, column] += 1.5 * amplitude * pulse
    rows = np.zeros((count, WIDTH))
    rows[:, ANGLES] = features + rng.normal(0.0, 0.02, features.shape)
    rows[:, HEADING] = (0.0, 1.0)
    return rows


def examples(
    people: Sequence[int] = (1, 2, 3), repetitions: int = 2, labels: Sequence[str] = LABELS, rate: float = RATE
) -> list[Example]:
    return [
        Example(label, str(person), str(repetition), rate, movement(label, person, repetition, rate=rate))
        for person in people
        for label in labels
        for repetition in range(repetitions)
    ]


@lru_cache
def quick_model(labels: Sequence[str] = LABELS) -> PostureModel:
    """A model without thresholds."""
    return train_models(prepare(examples(labels=labels), FAST), FAST)
