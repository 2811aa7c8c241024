"""Training of postures: deterministic to the bit, few examples, rejection of unknown movements."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.posture_cases import FAST, FAST_FOREST, LABELS, examples, movement
from zenocap.services.recognizer.model import NO_THRESHOLD, classify
from zenocap.services.recognizer.model_file import packed, parse_model
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.train import edges_of, reach_of, train

PATH = Path("some.postures")
of_both = pytest.mark.parametrize(
    "settings",
    [
        pytest.param(FAST, marks=pytest.mark.slow, id="paper"),
        pytest.param(FAST_FOREST, marks=pytest.mark.nightly, id="forest"),
    ],
)


@of_both
def test_equal_examples_settings_and_seed_give_equal_bytes_that_are_read_back(settings: TrainingSettings) -> None:
    one, other = (train(examples(), settings) for _ in range(2))
    data = packed(PATH, one)
    assert data == packed(PATH, other)
    assert data != packed(PATH, train(examples(), replace(settings, seed=1)))
    if settings is FAST_FOREST:
        again = parse_model(PATH, data).forest
        np.testing.assert_array_equal(one.forest.nodes, again.nodes)
        np.testing.assert_array_equal(one.forest.thresholds, again.thresholds)


@of_both
def test_figures_have_the_counts_of_training_and_of_held_out_recognition(settings: TrainingSettings) -> None:
    model = train(examples(), settings)
    assert model.training.people == ("1", "2", "3")
    assert model.training.frames == sum(len(example.features) for example in examples())
    assert model.training.settings["symbols"] == "24"
    for figures in model.training.figures:
        assert (figures.examples, figures.people, figures.held) == (6, 3, 6)
        assert figures.held >= figures.recognised >= figures.accepted >= (5 if settings is FAST else 0)
        assert figures.strangers >= figures.refused


@of_both
def test_an_untrained_movement_is_rejected(settings: TrainingSettings) -> None:
    model = train(examples(range(1, 7)), replace(settings, folds=3))
    known = {(label, person): classify(model, movement(label, person, 0)) for label in LABELS for person in range(50, 60)}
    assert sum(one.accepted for one in known.values()) >= (26 if settings is FAST else 25)
    assert settings is FAST or all(model.labels[one.best] == label for (label, _), one in known.items())
    assert sum(classify(model, movement("stretch", person, 0)).accepted for person in range(50, 60)) <= 2


def test_one_example_per_posture_gives_a_model_without_thresholds() -> None:
    model = train(examples((1,), 1), FAST)
    assert (model.thresholds == NO_THRESHOLD).all()
    assert [figures.held for figures in model.training.figures] == [0, 0, 0]
    found = classify(model, movement("kick", 1, 1))
    assert (model.labels[found.best], found.accepted) == ("kick", True)


def test_repetitions_are_held_out_with_only_one_person() -> None:
    model = train(examples((1,), 3), FAST)
    assert [figures.held for figures in model.training.figures] == [3, 3, 3]


@pytest.mark.slow
def test_a_posture_of_only_one_person_has_a_threshold() -> None:
    model = train([*examples(), Example("stretch", "1", "1", 15.0, movement("stretch", 1, 1))], FAST)
    assert model.training.figures[-1].held == 0
    assert model.thresholds[-1] > NO_THRESHOLD
    assert np.isfinite(model.thresholds).all()


def test_without_folds_there_are_no_thresholds() -> None:
    assert (train(examples(), replace(FAST, folds=0)).thresholds == NO_THRESHOLD).all()


@pytest.mark.parametrize(
    "changes", [{"topology": "ergodic"}, {"states": 1}, {"symbols": 8}, {"scale": "none"}, {"rate": 30.0}]
)
def test_every_training_setting_gives_a_model_that_separates_the_postures(changes: dict[str, object]) -> None:
    model = train(examples(), replace(FAST, folds=0, **changes))
    for label in LABELS:
        assert model.labels[classify(model, movement(label, 40, 0, rate=model.rate)).best] == label


@pytest.mark.slow
def test_progress_is_reported_from_zero_to_the_total() -> None:
    reports: list[tuple[int, int]] = []
    train(examples(), FAST, lambda done, of, words: reports.append((done, of)))
    assert reports[0] == (0, len(LABELS))
    assert (len(LABELS), len(LABELS)) in reports
    assert reports[-1] == (FAST.folds, FAST.folds)


def test_edges_are_the_means_of_the_first_and_last_frames_by_posture() -> None:
    up, down = np.array([[0.0], [2.0], [8.0], [4.0]]), np.array([[1.0], [1.0], [1.0]])
    edges, calm, slow = edges_of([0, 1], 2, [up, down], 10.0)
    np.testing.assert_allclose(edges, [[[1.0], [6.0]], [[1.0], [1.0]]])
    distances = [1, 1, 2, 2, 0, 0, 0, 0]
    assert calm == pytest.approx(np.quantile(distances, 0.95))
    assert slow == pytest.approx(np.quantile([20.0, 40.0, 0.0, 0.0], 0.95))


def test_reach_is_exceeded_by_95_percent_of_the_examples() -> None:
    vectors = [np.array([[1.0], [1.0 + far], [1.0]]) for far in (*range(1, 21), 100)]
    reach = reach_of([0] * 20 + [1], 2, vectors)
    assert reach[0] == pytest.approx(np.quantile(np.arange(1, 21), 0.05))
    assert reach[1] == 100.0


def test_equal_examples_of_two_people_give_a_model_that_is_read_back() -> None:
    features = movement("kick", 1, 0)
    model = train([Example("kick", person, "0", 15.0, features) for person in ("1", "2")], FAST)
    assert parse_model(PATH, packed(PATH, model)).farthest > 0.0
