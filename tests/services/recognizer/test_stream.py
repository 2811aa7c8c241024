"""Recognition in streams of any rate, with late vectors, lost persons and gaps."""

from collections.abc import Sequence

import numpy as np
import pytest

from tests.support.recognizer_cases import RATE, SECOND, small_model, stream_with
from zenocap.services.recognizer.stream import (
    GAP,
    LATE,
    LOST,
    USED,
    PoseStream,
    Recognition,
    initial_stream,
    push,
    stream_setup,
)

START = 1_700_000_000 * SECOND
NAMES = ["right arm", "kick", "unknown", "squat", "left arm"]
PAUSES_S = [0.5, 0.0, 0.7, 0.8, 0.2]


def results(times_s: Sequence[float], features: np.ndarray) -> list[tuple[Recognition, float]]:
    """Results with the times at which they are returned, seconds after START."""
    prepared = stream_setup(small_model())
    stream, found = initial_stream(prepared), []
    for time_s, row in zip(times_s, features, strict=True):
        stream, answer, _ = push(prepared, stream, START + round(time_s * SECOND), row)
        if answer is not None:
            found.append((answer, time_s))
    return found


def at_rate(rate: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, list[tuple[str, float, float]]]:
    """Times in seconds and vectors at another rate."""
    features, truth = stream_with(NAMES, PAUSES_S, seed)
    times = np.arange(0.0, (len(features) - 1) / RATE, 1.0 / rate)
    own = np.arange(len(features)) / RATE
    return times, np.stack([np.interp(times, own, column) for column in features.T], axis=1), truth


@pytest.mark.slow
@pytest.mark.parametrize("rate", [10.0, 15.0, 23.976, 30.0, 60.0])
def test_every_posture_is_found_once_at_its_time_and_soon_after_its_end(rate: float) -> None:
    times, features, truth = at_rate(rate)
    found = results(times, features)
    assert [answer.label or "unknown" for answer, _ in found] == [name for name, _, _ in truth]
    for (answer, found_s), (name, begin_s, end_s) in zip(found, truth, strict=True):
        assert (answer.start_ns - START) / SECOND == pytest.approx(begin_s, abs=0.5)
        assert (answer.end_ns - START) / SECOND == pytest.approx(end_s, abs=0.5)
        assert found_s - end_s <= (0.5 if name != "unknown" else 1.0)
        assert answer.start_ns < answer.end_ns <= START + round(found_s * SECOND)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_jitter_and_missing_frames_change_no_label(seed: int) -> None:
    times, features, truth = at_rate(30.0, seed)
    rng = np.random.default_rng(seed)
    kept = rng.uniform(size=len(times)) > 0.2
    jittered = times + rng.uniform(-0.01, 0.01, len(times))
    found = results(jittered[kept], features[kept])
    assert [answer.label or "unknown" for answer, _ in found] == [name for name, _, _ in truth]


@pytest.mark.slow
def test_equal_streams_give_identical_results() -> None:
    times, features, _ = at_rate(30.0)
    one, other = results(times, features), results(times, features)
    assert [(a.label, a.start_ns, a.end_ns, t) for a, t in one] == [(a.label, a.start_ns, a.end_ns, t) for a, t in other]
    for (a, _), (b, _) in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.classification.log_likelihoods, b.classification.log_likelihoods)


def use_of(stream: PoseStream, time_s: float, row: np.ndarray) -> tuple[PoseStream, str]:
    stream, _, use = push(stream_setup(small_model()), stream, START + round(time_s * SECOND), row)
    return stream, use


def test_vectors_are_reported_as_used_late_lost_or_gap() -> None:
    row, lost = np.zeros(10), np.full(10, np.nan)
    stream, first = use_of(initial_stream(stream_setup(small_model())), 1.0, row)
    stream, second = use_of(stream, 1.1, row)
    _, same = use_of(stream, 1.1, row)
    _, earlier = use_of(stream, 0.3, row)
    _, unknown = use_of(stream, 1.2, lost)
    stream, later = use_of(stream, 2.0, row)
    _, set_back = use_of(stream, -20.0, row)
    assert (first, second, same, earlier, unknown, later, set_back) == (USED, USED, LATE, LATE, LOST, GAP, GAP)


def test_a_short_loss_of_the_person_does_not_split_a_posture() -> None:
    times, features, truth = at_rate(30.0)
    with_loss = features.copy()
    with_loss[np.abs(times - (truth[0][1] + 1.0)) < 0.1] = np.nan
    assert next(answer.label for answer, _ in results(times, with_loss)) == truth[0][0]


def test_a_posture_that_has_ended_is_reported_when_the_person_is_lost() -> None:
    features, truth = stream_with(["kick"], [0.5])
    end = round(truth[0][2] * RATE)
    times = np.arange(end + 30) / RATE
    with_loss = np.concatenate([features[:end], np.full((30, 10), np.nan)])
    ((answer, found_s),) = results(times, with_loss)
    assert answer.label == "kick"
    assert found_s - truth[0][2] < 0.7


def test_no_posture_is_found_across_a_gap() -> None:
    features, truth = stream_with(["right arm"], [0.5])
    middle = round((truth[0][1] + truth[0][2]) / 2 * RATE)
    times = np.arange(len(features)) / RATE
    times[middle:] += 30.0
    assert [answer.label for answer, _ in results(times, features)] == []


@pytest.mark.nightly
def test_the_state_does_not_grow_with_the_stream() -> None:
    prepared = stream_setup(small_model())
    features, _ = stream_with(NAMES, PAUSES_S)
    stream, sizes = initial_stream(prepared), []
    for k in range(10 * len(features)):
        stream, _, _ = push(prepared, stream, START + round(k * SECOND / RATE), features[k % len(features)])
        if (k + 1) % len(features) == 0:
            sizes.append(size_of(stream))
    assert max(sizes[1:]) <= sizes[1]
    assert np.abs(stream.hypotheses.windows.gain).max() < 1e3


def size_of(stream: PoseStream) -> int:
    arrays = [*stream.hypotheses.windows, stream.hypotheses.origin]
    assert len(stream.windows) <= 16
    return sum(array.nbytes for array in arrays) + stream.rows.nbytes + len(stream.movement.recent)
