"""Loading what is compiled before the first pose: otherwise the first posture is answered seconds late."""

import numpy as np

from common.body.anatomy import Anatomy
from services.recognizer.features import DEFAULT, NAMES, features_of
from services.recognizer.model import LabelFigures, PostureModel, Training
from services.recognizer.stream import Plan, beginning, heard

POSES = 30


def load_compiled(plan: Plan, anatomy: Anatomy) -> int:
    """Hear a body that stands still and then is gone; how many answers that gave."""
    stream, answers = beginning(plan), 0
    standing = features_of(anatomy, anatomy.neutral, plan.kind)
    for k in range(POSES + 1):
        features = standing if k < POSES else np.full_like(standing, np.nan)
        stream, answer, _ = heard(plan, stream, round(k * plan.period_ns), features)
        answers += answer is not None
    return answers


def stand_in() -> PostureModel:
    """A model of one posture over two symbols, for compiling without a file."""
    d = len(NAMES)
    return PostureModel(
        features=DEFAULT, rate=15.0, labels=("any",), mean=np.zeros(d), whitening=np.eye(d),
        codebook=np.stack([np.zeros(d), np.ones(d)]), occurring=np.full(2, 0.5), start=np.array([[1.0, 0.0]]),
        transition=np.array([[[0.9, 0.1], [0.0, 1.0]]]), emission=np.full((1, 2, 2), 0.5),
        durations=np.ones((1, 3)), edges=np.zeros((1, 2, d)), reach=np.ones(1), thresholds=np.zeros(1),
        farthest=1.0, calm=1.0, slow=1.0, training=Training((), (), 0, {}, (LabelFigures(0, 0),)),
    )  # fmt: skip
