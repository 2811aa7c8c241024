"""Negative examples for the forest."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.stream import initial_stream, push, stream_setup
from zenocap.services.recognizer.training.parameters import BACKGROUND_STRIDE


def proposed_windows(model: PostureModel, sequences: Sequence[Floats]) -> list[Floats]:
    """Windows (t, d) that the hidden Markov models take for a posture: those on which the forest decides in a stream.

    model: with thresholds and without a forest.  sequences: (T_i, d) rows at the model's rate, all finite.
    """
    setup = stream_setup(model)
    found = []
    for rows in sequences:
        stream, windows = initial_stream(setup), []
        for k, row in enumerate(rows):
            stream, answer, _ = push(setup, stream, round(k * setup.period_ns), row)
            if answer is not None and answer.label is not None:
                windows.append((answer.start_ns, answer.end_ns))
        for start_ns, end_ns in windows:
            found.append(rows[round(start_ns / setup.period_ns) : round(end_ns / setup.period_ns) + 1])
    return found


def regular_windows(model: PostureModel, sequences: Sequence[Floats], seed: int) -> list[Floats]:
    """Windows (t, d) with lengths between those of the shortest and the longest example, over all sequences (T_i, d)."""
    rng = np.random.default_rng(seed)
    shortest, longest = (float(edge) for edge in (model.durations[:, 0].min(), model.durations[:, -1].max()))
    found = []
    for rows in sequences:
        begin = 0
        while begin < len(rows):
            length = max(2, round(rng.uniform(shortest, longest) * model.rate))
            if begin + length <= len(rows):
                found.append(rows[begin : begin + length])
            begin += max(1, round(BACKGROUND_STRIDE * length))
    return found
