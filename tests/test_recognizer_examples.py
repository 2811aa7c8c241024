"""Examples made ready, and what is wrong with those that cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from services.recognizer.examples import Example, ExampleError, Plan, prepared
from tests.posture_cases import LABELS, examples, movement


def one(**changes: object) -> Example:
    return replace(examples()[0], **changes)


def test_examples_of_any_rate_come_to_the_plans() -> None:
    ready = prepared([*examples(), *examples((8,), rate=60.0)], Plan(rate=30.0))
    seconds = [len(features) / 30.0 for features in ready.sequences]
    assert 1.7 < min(seconds) <= max(seconds) < 2.3
    assert ready.labels == LABELS


def test_short_gaps_are_bridged_and_long_ones_named_with_their_source() -> None:
    features = movement("wave", 1, 0)
    features[5:8, 3] = np.nan
    assert np.isfinite(prepared([one(features=features)], Plan()).sequences[0]).all()
    features[5:12] = np.nan
    with pytest.raises(ExampleError, match=r"^m\.csv: line 4: a\.bvh: no angles from 0\.33 s to 0\.80 s: allowed: gaps"):
        prepared([one(features=features, source="m.csv: line 4: a.bvh")], Plan())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"label": ""}, "posture '': allowed: 1 to 64 printable characters"),
        ({"label": "x" * 65}, "allowed: 1 to 64 printable characters"),
        ({"label": "a\nb"}, r"posture 'a\\nb': allowed"),
        ({"features": np.zeros((0, 10))}, r"features of shape \(0, 10\): allowed: \(1 or more, 10\)"),
        ({"features": np.zeros((1, 10))}, "1 frames: allowed: 2 or more at 15/s"),
        ({"rate": float("nan")}, "rate = nan: allowed: more than 0"),
        ({"rate": 0.0}, "rate = 0.0: allowed: more than 0"),
    ],
)
def test_what_is_wrong_with_an_example_is_named(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ExampleError, match=words):
        prepared([one(**changes)], Plan())


def test_examples_of_another_width_are_refused() -> None:
    with pytest.raises(ExampleError, match=r"features of shape \(9, 3\): allowed: \(1 or more, 10\)"):
        prepared([*examples(), one(features=np.zeros((9, 3)))], Plan())


def test_labels_are_any_words_but_not_more_than_a_message_holds() -> None:
    assert prepared([one(label="右手を上げる 🙋")], Plan()).labels == ("右手を上げる 🙋",)
    with pytest.raises(ExampleError, match="257 different postures: allowed: 256 at most"):
        prepared([one(label=str(k)) for k in range(257)], Plan())
    with pytest.raises(ExampleError, match="no examples"):
        prepared([], Plan())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"features": "knees"}, "features = 'knees': allowed: directions, joint-angles"),
        ({"topology": "ring"}, "topology = 'ring': allowed: left-right, ergodic"),
        ({"scale": "log"}, "scale = 'log': allowed: full, diagonal, none"),
        ({"symbols": 1}, "symbols = 1: allowed: 2 to 1024"),
        ({"states": 0}, "states = 0: allowed: 1 to 32"),
        ({"rate": float("nan")}, "rate = nan: allowed: 1 to 1000"),
        ({"floor": 0.0}, "floor = 0.0: allowed: 1e-06 to 0.5"),
    ],
)
def test_a_plan_out_of_range_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ExampleError, match=words):
        replace(Plan(), **changes)
