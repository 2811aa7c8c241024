"""A small posture model, and streams that contain its postures, for tests of the recognizer."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.recognizer.features import NAMES, features_of
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.motion_rows import rows_of
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.train import train
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.postures import posture

RATE, NOISE = 15.0, 0.03
SIMULATED_POSTURES = ("raise-both-arms", "squat", "kick-right")
SECOND = 1_000_000_000
STANDING = features_of(TEN_PARTS, TEN_PARTS.neutral)
# Features that a posture moves, with amplitudes, radians.
MOVES: dict[str, dict[str, float]] = {
    "right arm": {"right_shoulder.x": 1.5, "right_shoulder.z": 0.8, "right_elbow.x": 0.9},
    "left arm": {"left_shoulder.x": 1.5, "left_shoulder.z": 0.8, "left_elbow.x": 0.9},
    "kick": {"right_hip.x": 1.2, "right_hip.z": 0.4, "left_shoulder.x": 0.4},
    "squat": {"right_hip.x": 1.3, "left_hip.x": 1.3, "left_hip.z": 0.5, "right_hip.z": -0.5},
}
UNKNOWN = {"left_hip.z": -0.9, "right_elbow.x": 1.6, "left_elbow.x": 1.6, "right_shoulder.z": -1.0, "left_shoulder.z": -1.0}


def movement_features(moves: dict[str, float], seconds: float, rng: np.random.Generator) -> Floats:
    """(T, 10) out and back in the shape of half a sine squared, at RATE, from standing to standing."""
    count = round(seconds * RATE)
    share = np.sin(np.pi * np.arange(count) / (count - 1)) ** 2
    target = np.zeros(len(NAMES))
    for name, value in moves.items():
        target[NAMES.index(name)] = value
    return STANDING + share[:, None] * target + rng.normal(0.0, NOISE, (count, len(NAMES)))


def standing(seconds: float, rng: np.random.Generator) -> Floats:
    return STANDING + rng.normal(0.0, NOISE, (round(seconds * RATE), len(NAMES)))


@lru_cache
def small_model() -> PostureModel:
    """Four postures by six people, twice each."""
    examples = []
    for subject in range(6):
        rng = np.random.default_rng([1, subject])
        for label, moves in MOVES.items():
            for repetition in range(2):
                scaled = {name: value * float(rng.uniform(0.9, 1.1)) for name, value in moves.items()}
                features = movement_features(scaled, float(rng.uniform(1.8, 2.2)), rng)
                examples.append(Example(label, str(subject), str(repetition), RATE, features))
    return train(examples, TrainingSettings(symbols=32, classifier="paper"))


def stream_with(
    names: Sequence[str], pauses_s: Sequence[float], seed: int = 0
) -> tuple[Floats, list[tuple[str, float, float]]]:
    """(T, 10) at RATE: a second of standing, then the named postures ("unknown" for another), each after a pause.

    Also name, begin and end (s) of each.  The stream ends with two seconds of standing.
    """
    rng = np.random.default_rng([2, seed])
    parts, truth = [standing(1.0, rng)], []
    for name, pause_s in zip(names, pauses_s, strict=True):
        parts.append(standing(pause_s, rng))
        begin_s = sum(map(len, parts)) / RATE
        parts.append(movement_features(MOVES.get(name, UNKNOWN), 2.0, rng))
        truth.append((name, begin_s, sum(map(len, parts)) / RATE))
    return np.concatenate([*parts, standing(2.0, rng)]), truth


def angles_of_posture(name: str, subject: int, repetition: int) -> Floats:
    """(T, angles) of the ten-part anatomy at RATE; before it 8 rows of standing, after it 12."""
    actor = person(subject)
    motion = posture(actor, name, repetition)
    times = np.concatenate([np.zeros(8), np.arange(0.0, motion.duration_s, 1.0 / RATE), np.full(12, motion.duration_s)])
    return np.array([truth(actor, motion.pose_at(float(time_s))).ten_part_pose().angles for time_s in times])


def rows_of_posture(name: str, subject: int, repetition: int) -> Floats:
    """(T, WIDTH) rows of `angles_of_posture` by a person who stays at the origin."""
    angles = angles_of_posture(name, subject, repetition)
    return rows_of(TEN_PARTS, np.zeros((len(angles), 3)), angles)


@lru_cache
def actor_model() -> PostureModel:
    """A model of three postures from true angles of the simulated person."""
    examples = [
        Example(name, str(subject), str(k), RATE, rows_of_posture(name, subject, k)[8:-12])
        for name in SIMULATED_POSTURES
        for subject in range(404, 410)
        for k in (0, 1)
    ]
    return train(examples, TrainingSettings())
