"""Models that ignore a body part: it changes no answer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.posture_cases import FAST_FOREST, RATE, examples, movement
from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import NAMES
from zenocap.services.recognizer.ignored_parts import PARTS, columns_of, parts_of, without_parts
from zenocap.services.recognizer.model import classify
from zenocap.services.recognizer.model_file import packed, parse_model
from zenocap.services.recognizer.motion_rows import HEIGHT, WAY, WIDTH
from zenocap.services.recognizer.stream import recognitions, stream_setup
from zenocap.services.recognizer.training.train import train

PATH = Path("some.postures")
NO_LEGS = replace(FAST_FOREST, ignored=("legs",))
ARM_POSTURES = ("wave", "stretch")


def test_every_angle_and_joint_belongs_to_one_part() -> None:
    columns = np.concatenate([columns_of([part]) for part in PARTS])
    assert len(set(columns.tolist())) == len(columns)
    assert set(range(len(NAMES))) <= set(columns.tolist())
    assert HEIGHT in columns_of(["legs"])
    assert max(columns) < WAY.start


def test_lost_rows_stay_lost_and_others_lose_the_part_alone() -> None:
    rows = np.random.default_rng(0).normal(size=(4, WIDTH))
    rows[1] = np.nan
    left = without_parts(rows, ["legs"])
    assert np.isnan(left[1]).all()
    others = np.setdiff1d(np.arange(WIDTH), columns_of(["legs"]))
    np.testing.assert_array_equal(left[:, others], rows[:, others])
    assert (left[[0, 2, 3]][:, columns_of(["legs"])] == 0.0).all()
    assert without_parts(rows, []) is rows
    assert without_parts(rows[0, : len(NAMES)], ["head"]).shape == (len(NAMES),)


@pytest.mark.nightly
def test_ignored_legs_change_neither_the_class_of_a_window_nor_the_answers_of_a_stream() -> None:
    model = train(examples(range(1, 5), labels=ARM_POSTURES), NO_LEGS)
    assert model.training.settings["ignored"] == "legs"
    again = parse_model(PATH, packed(PATH, model))
    assert again.ignored == ("legs",)
    rest = movement("wave", 9, 0)[:1].repeat(round(1.5 * RATE), axis=0)
    rows = np.concatenate([rest, movement("wave", 9, 0), rest, movement("stretch", 9, 1), rest])
    moving = rows.copy()
    moving[:, columns_of(["legs"])] += np.random.default_rng(1).normal(size=(len(rows), 1))
    found = []
    for one in (rows, moving):
        setup = stream_setup(again)
        answers = recognitions(setup, [round(k * setup.period_ns) for k in range(len(one))], one)
        spans = [(answer.label, answer.start_ns, answer.end_ns) for _, answer in answers]
        found.append((spans, classify(again, one[:30]).scores.tolist()))
    assert found[0] == found[1]
    assert [label for label, *_ in found[0][0] if label] == ["wave", "stretch"]


@pytest.mark.nightly
def test_files_without_ignored_parts_are_as_before() -> None:
    model = train(examples(), FAST_FOREST)
    assert b"ignored" not in packed(PATH, model)
    assert parse_model(PATH, packed(PATH, model)).ignored == ()
    wrong = replace(model, ignored=("tail",))  # type: ignore[arg-type]
    with pytest.raises(UserError, match="ignored"):
        packed(PATH, wrong)


def test_a_posture_of_ignored_parts_alone_is_refused() -> None:
    with pytest.raises(UserError, match=r"ignored = legs: posture 'kick', 'bow' moves the other limbs by less than 0.35"):
        train(examples(), NO_LEGS)
    with pytest.raises(UserError, match=r"ignored = legs, arms: allowed: each part once, arms or legs but not both"):
        replace(FAST_FOREST, ignored=("legs", "arms"))
    assert parts_of(" legs, head") == ("legs", "head")
    with pytest.raises(UserError, match=r"ignored = 'tail': allowed: arms, legs, head"):
        parts_of("legs,tail")
    with pytest.raises(UserError, match=r"ignored = 'tail': allowed: arms, legs, head"):
        replace(FAST_FOREST, ignored=("tail",))  # type: ignore[arg-type]
