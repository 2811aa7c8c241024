"""`make postures` with few people, its everyday movement, and the built-in models."""

import sys
from pathlib import Path

import pytest

from zenocap.services.recognizer.model_file import find_model, packed, read_model
from zenocap.services.recognizer.training.examples import BACKGROUND, TrainingSettings
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.tools.teach.dataset import build_postures
from zenocap.tools.teach.dataset.batch import people, posture_takes
from zenocap.tools.teach.dataset.build_postures import REPETITIONS, background_rows, session_of

SMALL = posture_takes([7, 8], ("squat", "kick-left"), 1)


@pytest.mark.nightly
def test_model_does_not_depend_on_the_folder_of_its_takes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_postures, "METHODS", ("truth",))
    one, other = (
        build_postures.shipped_model(tmp_path / name, SMALL, [9], 1, TrainingSettings(folds=2)) for name in ("one", "other")
    )
    assert packed(tmp_path, one) == packed(tmp_path, other)
    assert one.labels == ("squat", "kick-left")


@pytest.mark.nightly
def test_model_is_written_to_the_given_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_postures, "METHODS", ("truth",))
    monkeypatch.setattr(build_postures, "posture_takes", lambda _people: SMALL)
    monkeypatch.setattr(build_postures, "BACKGROUND_PEOPLE", 1)
    monkeypatch.setattr(
        sys, "argv", ["build_postures", "--to", str(tmp_path / "to"), "--takes", str(tmp_path), "--jobs", "1"]
    )
    build_postures.main()
    assert read_model(tmp_path / "to" / "fifteen.postures").labels == ("squat", "kick-left")


def test_built_in_model_recognizes_the_fifteen_postures() -> None:
    model = read_model(find_model("fifteen"))
    assert model.labels == POSTURES
    assert model.training.people == tuple(sorted(str(one) for one in people(build_postures.PEOPLE_SEED)))
    assert not any("/" in source for source in model.training.sources)
    recognized = sum(row.recognised for row in model.training.figures)
    assert recognized > 0.9 * sum(row.held for row in model.training.figures)


@pytest.mark.nightly
def test_rows_contain_every_activity_and_no_posture(tmp_path: Path) -> None:
    rows = list(background_rows(tmp_path, "truth", [9]))
    assert {row.posture for row in rows} == {BACKGROUND}
    assert all(row.source.is_file() for row in rows)
    segments = session_of(9).segments
    inside = [
        segment.name
        for segment in segments
        for row in rows
        if row.start is not None and row.end is not None
        if min(segment.end_s, row.end) - max(segment.start_s, row.start) > 1e-6
    ]
    assert not set(inside) & set(POSTURES)
    assert [inside.count(name) for name in ACTIVITIES] == [REPETITIONS] * len(ACTIVITIES)
    assert list(background_rows(tmp_path, "truth", [9])) == rows
