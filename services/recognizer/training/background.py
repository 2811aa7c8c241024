"""Movement without postures: negative examples for the forest, and its thresholds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.services.recognizer.false_alarms import FalseAlarms, least_share
from zenocap.services.recognizer.forest import Forest, votes_of
from zenocap.services.recognizer.model import NO_DISTANCE_LIMIT, NO_THRESHOLD, PostureModel
from zenocap.services.recognizer.segment_description import VALUES, describe
from zenocap.services.recognizer.stream import StreamSetup, recognitions, stream_setup
from zenocap.services.recognizer.training.forest import ForestData, forest_of
from zenocap.services.recognizer.training.parameters import BACKGROUND_STRIDE


def negatives_of(model: PostureModel, sequences: Sequence[Floats], seed: int) -> tuple[Floats, Floats]:
    """Descriptions (m, VALUES) of windows without a posture, for the forest: proposed ones, and regular ones.

    Proposed: those that the hidden Markov models take for a posture, on which the forest decides in a stream.
    model: with thresholds and without a forest.  sequences: (T_i, d) rows at the model's rate, all finite.
    """
    proposed = _windows(stream_setup(model), sequences, ended=False)
    return _described(model, proposed), _described(model, regular_windows(model, sequences, seed))


def _described(model: PostureModel, windows: Sequence[Floats]) -> Floats:
    return np.array([describe(rows, model.rate) for rows in windows]).reshape(-1, VALUES)


def _windows(setup: StreamSetup, sequences: Sequence[Floats], *, ended: bool) -> list[Floats]:
    """Windows (t, d) that are answered with a posture.  ended: with those that a gap after each sequence answers."""
    found = []
    for rows in sequences:
        times_ns = [round(k * setup.period_ns) for k in range(len(rows))]
        for number, answer in recognitions(setup, times_ns, rows):
            if answer.label is not None and (ended or number < len(rows)):
                first, last = (round(at / setup.period_ns) for at in (answer.start_ns, answer.end_ns))
                found.append(rows[first : last + 1])
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


def open_setup(model: PostureModel) -> StreamSetup:
    """Setup of a stream in which every window of the segmentation is answered with the likeliest posture.

    model: without a forest.  Windows are those of the model's own setup: answers do not change them.
    """
    return replace(stream_setup(model), model=replace(
        model, thresholds=np.full(len(model.labels), NO_THRESHOLD), farthest=NO_DISTANCE_LIMIT
    ))  # fmt: skip


def windows_of(model: PostureModel, sequences: Sequence[Floats]) -> list[Floats]:
    """All windows (t, d) of the segmentation, on which a forest decides in a stream with a gap after each sequence.

    model, sequences: see `negatives_of`.
    """
    return _windows(open_setup(model), sequences, ended=True)


def halves_of(sequences: Sequence[Floats]) -> tuple[list[Floats], list[Floats]]:
    """Sequences (T_i, d) of the first and of the second half of the time; the one in the middle is cut."""
    left = sum(map(len, sequences)) // 2
    first: list[Floats] = []
    second: list[Floats] = []
    for rows in sequences:
        cut = min(left, len(rows))
        first += [rows[:cut]] if cut else []
        second += [rows[cut:]] if cut < len(rows) else []
        left -= cut
    return first, second


def false_alarms_of(
    model: PostureModel, forest: Forest, data: ForestData, background: Sequence[Floats], seed: int
) -> FalseAlarms:
    """False postures in each half of a background, by a forest trained with the other half, with a forest's thresholds.

    model: with thresholds and without a forest.  data: of the examples; its background is not used.
    """
    trees, every = len(forest.nodes), np.arange(len(data.labels))
    halves = halves_of(background)
    shares: list[float] = []
    for own, other in (halves, halves[::-1]):
        proposed, regular = negatives_of(model, other, seed)
        tried = forest_of(replace(data, proposed=proposed, regular=regular), every, trees, seed)
        for rows in windows_of(model, own):
            votes = votes_of(tried, describe(rows, model.rate))
            best = int(np.argmax(votes[:-1]))
            if votes[best] >= max(forest.thresholds[best] * trees, votes[-1]):
                shares.append(float(votes[best] / trees))
    return FalseAlarms(sum(map(len, background)) / model.rate / 3600.0, np.sort(np.array(shares, dtype=np.float64)))


def with_rate(forest: Forest, alarms: FalseAlarms, per_hour: float) -> Forest:
    """The forest with thresholds raised to the share of the votes that `per_hour` false postures need, see `least_share`.

    Raises UserError where false postures have the votes of all trees.
    """
    least = least_share(alarms.shares, alarms.hours, per_hour, 1.0 / len(forest.nodes))
    if least > 1.0:
        raise UserError(
            f"false_per_hour = {per_hour:g}: more false postures in {60 * alarms.hours:.1f} min of background have the "
            "votes of all trees: allowed: a larger number, more examples, or a background without the postures"
        )
    return replace(forest, thresholds=np.maximum(forest.thresholds, least), alarms=replace(alarms, least=least))
