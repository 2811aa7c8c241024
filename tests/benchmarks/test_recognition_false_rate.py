"""The measured rate of false postures: its interval, and models that differ only in their thresholds."""

import numpy as np
import pytest

from benchmarks.cases.recognition.false_rate import RATES, UNLIMITED, false_postures, hours_of, interval, models
from tests.services.recognizer.training.test_rejection_rate import background
from tests.support.posture_cases import RATE, examples, movement
from zenocap.services.recognizer.training.examples import BACKGROUND, Example, TrainingSettings
from zenocap.services.recognizer.training.train import train


@pytest.mark.parametrize(("count", "low", "high"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.39)])
def test_the_interval_is_that_of_a_poisson_rate(count: int, low: float, high: float) -> None:
    assert interval(count, 1.0) == pytest.approx((low, high), rel=1e-3)
    assert interval(count, 4.0) == pytest.approx((low / 4, high / 4), rel=1e-3)


@pytest.mark.nightly
def test_models_are_those_of_a_training_with_the_rate() -> None:
    people, others = examples(range(1, 7)), background(range(20, 24), 24)
    found = dict(models(people, others))
    assert UNLIMITED in found
    for rate, model in found.items():
        trained = train([*people, *others], TrainingSettings(false_per_hour=rate)).forest
        assert model.forest is not None
        assert trained is not None
        np.testing.assert_array_equal(model.forest.thresholds, trained.thresholds)
    assert set(found) <= set(RATES)


@pytest.mark.nightly
def test_postures_count_as_false_ones_and_rest_does_not() -> None:
    model = dict(models(examples(range(1, 7)), background(range(20, 24))))[UNLIMITED]
    wave, rest = movement("wave", 30, 3), np.repeat(movement("wave", 30, 3)[:1], round(4 * RATE), axis=0)
    waves = Example(BACKGROUND, "30", "1", RATE, np.concatenate([rest, wave, rest, wave, rest]))
    still = Example(BACKGROUND, "30", "2", RATE, rest)
    assert false_postures(model, waves) == 2
    assert false_postures(model, still) == 0
    assert hours_of([waves, still]) == pytest.approx((len(waves.features) + len(rest)) / RATE / 3600)
