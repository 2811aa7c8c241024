"""Postures in a stream: what was hidden is found, whatever the rate and the order of what comes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from recognizer_cases import RATE, SECOND, hidden, small_model

from services.recognizer.stream import FRESH, GAP, LATE, UNKNOWN, Answer, Plan, Stream, beginning, heard, plan_of

START = 1_700_000_000 * SECOND
NAMES = ["right arm", "kick", "unknown", "squat", "left arm"]
PAUSES_S = [0.5, 0.0, 0.7, 0.8, 0.2]


def plan() -> Plan:
    return plan_of(small_model())


def answers(times_s: Sequence[float], features: np.ndarray) -> list[tuple[Answer, float]]:
    """With the times at which they came, seconds after START."""
    prepared = plan()
    stream, found = beginning(prepared), []
    for time_s, row in zip(times_s, features, strict=True):
        stream, answer, _ = heard(prepared, stream, START + round(time_s * SECOND), row)
        if answer is not None:
            found.append((answer, time_s))
    return found


def at_rate(rate: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, list[tuple[str, float, float]]]:
    """Times in seconds and vectors at another rate."""
    features, truth = hidden(NAMES, PAUSES_S, seed)
    times = np.arange(0.0, (len(features) - 1) / RATE, 1.0 / rate)
    own = np.arange(len(features)) / RATE
    return times, np.stack([np.interp(times, own, column) for column in features.T], axis=1), truth


@pytest.mark.parametrize("rate", [10.0, 15.0, 23.976, 30.0, 60.0])
def test_every_posture_is_found_once_where_it_is_and_soon_after_its_end(rate: float) -> None:
    times, features, truth = at_rate(rate)
    found = answers(times, features)
    assert [answer.label or "unknown" for answer, _ in found] == [name for name, _, _ in truth]
    for (answer, told_s), (name, begin_s, end_s) in zip(found, truth, strict=True):
        assert (answer.start_ns - START) / SECOND == pytest.approx(begin_s, abs=0.5)
        assert (answer.end_ns - START) / SECOND == pytest.approx(end_s, abs=0.5)
        assert told_s - end_s <= (0.5 if name != "unknown" else 1.0)
        assert answer.start_ns < answer.end_ns <= START + round(told_s * SECOND)


@pytest.mark.parametrize("seed", range(4))
def test_times_that_tremble_and_frames_that_are_missing_change_no_label(seed: int) -> None:
    times, features, truth = at_rate(30.0, seed)
    rng = np.random.default_rng(seed)
    kept = rng.uniform(size=len(times)) > 0.2
    shaken = times + rng.uniform(-0.01, 0.01, len(times))
    found = answers(shaken[kept], features[kept])
    assert [answer.label or "unknown" for answer, _ in found] == [name for name, _, _ in truth]


def test_equal_streams_give_equal_answers_to_the_last_digit() -> None:
    times, features, _ = at_rate(30.0)
    one, other = answers(times, features), answers(times, features)
    assert [(a.label, a.start_ns, a.end_ns, t) for a, t in one] == [(a.label, a.start_ns, a.end_ns, t) for a, t in other]
    for (a, _), (b, _) in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.judgement.log_likelihoods, b.judgement.log_likelihoods)


def became(stream: Stream, time_s: float, row: np.ndarray) -> tuple[Stream, str]:
    stream, _, what = heard(plan(), stream, START + round(time_s * SECOND), row)
    return stream, what


def test_what_becomes_of_a_vector() -> None:
    row, lost = np.zeros(10), np.full(10, np.nan)
    stream, first = became(beginning(plan()), 1.0, row)
    stream, second = became(stream, 1.1, row)
    _, same = became(stream, 1.1, row)
    _, earlier = became(stream, 0.3, row)
    _, unknown = became(stream, 1.2, lost)
    stream, later = became(stream, 2.0, row)
    _, set_back = became(stream, -20.0, row)
    assert (first, second, same, earlier, unknown, later, set_back) == (FRESH, FRESH, LATE, LATE, UNKNOWN, GAP, GAP)


def test_a_person_who_is_lost_for_a_moment_is_followed_across_it() -> None:
    times, features, truth = at_rate(30.0)
    gone = features.copy()
    gone[np.abs(times - (truth[0][1] + 1.0)) < 0.1] = np.nan
    assert next(answer.label for answer, _ in answers(times, gone)) == truth[0][0]


def test_a_posture_that_has_ended_is_told_when_the_person_goes() -> None:
    features, truth = hidden(["kick"], [0.5])
    end = round(truth[0][2] * RATE)
    times = np.arange(end + 30) / RATE
    gone = np.concatenate([features[:end], np.full((30, 10), np.nan)])
    ((answer, told_s),) = answers(times, gone)
    assert answer.label == "kick"
    assert told_s - truth[0][2] < 0.7


def test_nothing_is_made_up_across_a_gap() -> None:
    features, truth = hidden(["right arm"], [0.5])
    middle = round((truth[0][1] + truth[0][2]) / 2 * RATE)
    times = np.arange(len(features)) / RATE
    times[middle:] += 30.0
    assert [answer.label for answer, _ in answers(times, features)] == []


def test_a_long_stream_takes_no_more_room_than_a_short_one() -> None:
    prepared = plan()
    features, _ = hidden(NAMES, PAUSES_S)
    stream, sizes = beginning(prepared), []
    for k in range(10 * len(features)):
        stream, _, _ = heard(prepared, stream, START + round(k * SECOND / RATE), features[k % len(features)])
        if (k + 1) % len(features) == 0:
            sizes.append(size_of(stream))
    assert max(sizes[1:]) <= sizes[1]
    assert np.abs(stream.hypotheses.worth).max() < 1e3


def size_of(stream: Stream) -> int:
    arrays = [value for value in vars(stream.hypotheses).values() if isinstance(value, np.ndarray)]
    assert len(stream.windows) <= 16
    return sum(array.nbytes for array in arrays) + stream.rows.nbytes + len(stream.moving.recent)


def test_features_of_another_version_are_refused() -> None:
    with pytest.raises(ValueError, match="features = 'toes': allowed: directions, joint-angles"):
        plan_of(replace(small_model(), features="toes"))
