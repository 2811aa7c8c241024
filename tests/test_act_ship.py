"""`make postures`, of fewer people than are shipped, and what is shipped."""

import sys
from pathlib import Path

import pytest

from common.actor.style import POSTURES
from services.recognizer.examples import Plan
from services.recognizer.file import find_model, packed, read_model
from services.takes.act import ship
from services.takes.act.cast import acts, people

SMALL = acts([7, 8], ("squat", "kick-left"), 1)


def test_the_model_is_the_same_wherever_its_takes_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ship, "METHODS", ("truth",))
    one, other = (ship.shipped_model(tmp_path / name, SMALL, 1, Plan(folds=2)) for name in ("one", "other"))
    assert packed(tmp_path, one) == packed(tmp_path, other)
    assert one.labels == ("squat", "kick-left")


def test_the_named_folder_gets_the_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ship, "METHODS", ("truth",))
    monkeypatch.setattr(ship, "acts", lambda _people: SMALL)
    monkeypatch.setattr(sys, "argv", ["ship", "--to", str(tmp_path / "to"), "--takes", str(tmp_path), "--jobs", "1"])
    ship.main()
    assert read_model(tmp_path / "to" / "fifteen.postures").labels == ("squat", "kick-left")


def test_what_is_shipped_knows_the_fifteen_postures_of_these_people() -> None:
    model = read_model(find_model("fifteen"))
    assert model.labels == POSTURES
    assert model.training.people == tuple(sorted(str(one) for one in people(ship.PEOPLE_SEED)))
    assert not any("/" in source for source in model.training.sources)
    recognised = sum(row.recognised for row in model.training.figures)
    assert recognised > 0.9 * sum(row.held for row in model.training.figures)
