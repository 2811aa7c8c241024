"""Compilation of the recognizer's kernels before the first pose."""

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.services.recognizer.features import DEFAULT, NAMES
from zenocap.services.recognizer.forest import Forest
from zenocap.services.recognizer.model import LabelFigures, PostureModel, Training, classify
from zenocap.services.recognizer.motion_rows import rows_of
from zenocap.services.recognizer.stream import StreamSetup, initial_stream, push

POSES = 3


def load_compiled(setup: StreamSetup, anatomy: Anatomy) -> None:
    """Run every kernel of the recognizer with the arrays of a model."""
    stream = initial_stream(setup)
    row = rows_of(anatomy, np.zeros((1, 3)), anatomy.neutral[None], setup.model.features)[0]
    for k in range(POSES):
        stream, _, _ = push(setup, stream, round(k * setup.period_ns), row)
    classify(setup.model, np.stack([row, row]))


def minimal_model() -> PostureModel:
    """Model of one posture over two symbols, to compile without a file."""
    d = len(NAMES)
    return PostureModel(
        features=DEFAULT, rate=15.0, labels=("any",), mean=np.zeros(d), whitening=np.eye(d),
        codebook=np.stack([np.zeros(d), np.ones(d)]), occurring=np.full(2, 0.5), start=np.array([[1.0, 0.0]]),
        transition=np.array([[[0.9, 0.1], [0.0, 1.0]]]), emission=np.full((1, 2, 2), 0.5),
        durations=np.ones((1, 3)), edges=np.zeros((1, 2, d)), reach=np.ones(1), thresholds=np.zeros(1),
        farthest=1.0, calm=1.0, slow=1.0, training=Training((), (), 0, {}, (LabelFigures(0, 0),)),
        forest=Forest(np.array([[[-1.0, 0.0, 0.0]]]), np.zeros(1)),
    )  # fmt: skip
