"""Training of the forest: deterministic, votes as scikit-learn's, held-out thresholds."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesClassifier

from tests.support.posture_cases import FAST_FOREST, LABELS, RATE, examples, movement
from zenocap.common.errors import UserError
from zenocap.services.recognizer.forest import votes_of
from zenocap.services.recognizer.model import classify
from zenocap.services.recognizer.segment_description import VALUES
from zenocap.services.recognizer.training import forest as forest_training
from zenocap.services.recognizer.training.cross_validation import cross_validate
from zenocap.services.recognizer.training.examples import BACKGROUND, Example, prepare
from zenocap.services.recognizer.training.forest import ForestData, descriptions_of, train_forest, trials_of
from zenocap.services.recognizer.training.parameters import CUTS
from zenocap.services.recognizer.training.thresholds import held_out_groups
from zenocap.services.recognizer.training.train import train


@pytest.mark.nightly
def test_examples_get_the_votes_of_their_own_posture() -> None:
    ready = prepare(examples(), FAST_FOREST)
    values = descriptions_of(ready, RATE, 0)
    assert values.shape == (18, CUTS + 1, VALUES)
    votes = np.array([votes_of(train_forest(values[:, 0], ready.indices, 5, 30, 0), one) for one in values[:, 0]])
    np.testing.assert_array_equal(votes.argmax(axis=1), ready.indices)
    assert votes.max(axis=1).min() >= 20
    assert (votes.sum(axis=1) == 30).all()


@pytest.mark.slow
def test_a_posture_without_examples_gets_no_votes() -> None:
    ready = prepare(examples(), FAST_FOREST)
    values = descriptions_of(ready, RATE, 0)
    votes = votes_of(train_forest(values[:, 0], 2 * ready.indices, 6, 30, 0), values[0, 0])
    assert votes[[1, 3, 5, 6]].sum() == 0
    assert votes.sum() == 30


@pytest.mark.nightly
def test_one_example_of_each_posture_gives_a_forest_that_accepts() -> None:
    found = classify(train(examples((1,), 1), FAST_FOREST), movement("kick", 1, 1))
    assert (LABELS[found.best], found.accepted) == ("kick", True)


def test_error_for_rows_with_angles_only() -> None:
    ten = [Example(one.label, one.person, one.repetition, RATE, one.features[:, :10]) for one in examples()]
    with pytest.raises(UserError, match="10 columns: allowed: 45 for"):
        train(ten, FAST_FOREST)


def background(person: int) -> Example:
    """Many stretches, one after another, with pauses."""
    rows = [movement("stretch", person, repetition) for repetition in range(12)]
    return Example(BACKGROUND, str(person), "0", RATE, np.concatenate(rows))


@pytest.mark.nightly
def test_background_is_rejected_although_its_movement_resembles_a_posture() -> None:
    own = examples(range(1, 7))
    settings = replace(FAST_FOREST, folds=3)
    model = train([*own, *(background(person) for person in (1, 2, 3))], settings)
    assert model.labels == LABELS
    assert model.training.people == tuple(str(person) for person in range(1, 7))
    votes = [classify(model, movement("stretch", person, 0)) for person in range(50, 60)]
    assert not any(one.accepted for one in votes)
    known = [classify(model, movement(label, person, 0)).accepted for label in LABELS for person in range(50, 60)]
    assert np.mean(known) > 0.85


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_windows_of_background_are_all_tried(count: int) -> None:
    ready = prepare(examples(), FAST_FOREST)
    values = descriptions_of(ready, RATE, 0)
    data = ForestData(values, ready.indices, len(LABELS), values[:count, 1], np.zeros((0, VALUES)))
    assert len(trials_of(data, held_out_groups(ready, 2), 5, 0).background) == count


@pytest.mark.nightly
def test_background_is_no_posture_of_cross_validation() -> None:
    assert cross_validate([*examples(), background(1)], FAST_FOREST, "subjects").labels == LABELS


def test_votes_are_those_of_the_trees_of_scikit_learn(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[ExtraTreesClassifier] = []

    class Kept(ExtraTreesClassifier):
        def fit(self, *args: object, **kwargs: object) -> object:
            fitted.append(self)
            return super().fit(*args, **kwargs)

    monkeypatch.setattr(forest_training, "ExtraTreesClassifier", Kept)
    rng = np.random.default_rng(3)
    labels = rng.integers(0, 4, 200)
    values = rng.normal(size=(200, VALUES)) + labels[:, None] * rng.normal(size=VALUES) * 0.3
    forest = train_forest(values, labels, 4, 25, 0)
    tested = rng.normal(size=(50, VALUES))
    of_trees = np.array(
        [np.argmax(tree.predict_proba(tested.astype(np.float32)), axis=1) for tree in fitted[0].estimators_]
    )
    votes = np.array([votes_of(forest, one) for one in tested])
    np.testing.assert_array_equal(votes, [np.bincount(column, minlength=5) for column in of_trees.T])
