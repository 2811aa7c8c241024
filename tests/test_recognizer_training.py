"""Learning postures: the same bits every time, few examples, and whether a stranger is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from services.recognizer.examples import Example, Plan
from services.recognizer.file import packed
from services.recognizer.model import LEAST_SCORE, judge
from services.recognizer.training import train
from tests.posture_cases import FAST, LABELS, examples, movement

AT = Path("some.postures")


def test_the_same_examples_and_plan_give_the_same_bytes_and_another_seed_others() -> None:
    one, other = (packed(AT, train(examples(), FAST)) for _ in range(2))
    assert one == other
    assert one != packed(AT, train(examples(), replace(FAST, seed=1)))


def test_figures_say_what_was_learnt_and_how_well_held_out_people_were_told_apart() -> None:
    model = train(examples(), FAST)
    assert model.training.people == ("1", "2", "3")
    assert model.training.frames == sum(len(example.features) for example in examples())
    assert model.training.settings["symbols"] == "24"
    for figures in model.training.figures:
        assert (figures.examples, figures.people, figures.held) == (6, 3, 6)
        assert figures.held >= figures.recognised >= figures.accepted >= 5
        assert figures.strangers >= figures.refused


def test_a_movement_that_nobody_taught_is_none_of_these() -> None:
    model = train(examples(range(1, 7)), replace(FAST, folds=3))
    known = [judge(model, movement(label, person, 0)).known for label in LABELS for person in range(50, 60)]
    assert np.mean(known) > 0.85
    strange = [judge(model, movement("stretch", person, 0)).known for person in range(50, 60)]
    assert np.mean(strange) < 0.3


def test_one_example_of_each_posture_trains_and_knows_everything() -> None:
    model = train(examples((1,), 1), FAST)
    assert (model.thresholds == LEAST_SCORE).all()
    assert [figures.held for figures in model.training.figures] == [0, 0, 0]
    found = judge(model, movement("kick", 1, 1))
    assert (model.labels[found.best], found.known) == ("kick", True)


def test_one_person_alone_holds_out_repetitions() -> None:
    model = train(examples((1,), 3), FAST)
    assert [figures.held for figures in model.training.figures] == [3, 3, 3]


def test_a_posture_that_one_person_shows_has_a_threshold_too() -> None:
    model = train([*examples(), Example("stretch", "1", "1", 15.0, movement("stretch", 1, 1))], FAST)
    assert model.training.figures[-1].held == 0
    assert model.thresholds[-1] > LEAST_SCORE
    assert np.isfinite(model.thresholds).all()


def test_without_folds_there_are_no_thresholds() -> None:
    assert (train(examples(), replace(FAST, folds=0)).thresholds == LEAST_SCORE).all()


@pytest.mark.parametrize(
    "changes", [{"topology": "ergodic"}, {"states": 1}, {"symbols": 8}, {"scale": "none"}, {"rate": 30.0}]
)
def test_every_way_to_learn_gives_models_that_tell_apart(changes: dict[str, object]) -> None:
    plan: Plan = replace(FAST, folds=0, **changes)
    model = train(examples(), plan)
    rate = plan.rate
    for label in LABELS:
        assert model.labels[judge(model, movement(label, 40, 0, rate=rate)).best] == label


def test_progress_is_told_from_none_to_all() -> None:
    said: list[tuple[int, int]] = []
    train(examples(), FAST, lambda done, of, words: said.append((done, of)))
    assert said[0] == (0, len(LABELS))
    assert (len(LABELS), len(LABELS)) in said
    assert said[-1] == (FAST.folds, FAST.folds)
