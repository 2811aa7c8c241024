"""`make priors`, of fewer people and regions than are shipped."""

import sys
from pathlib import Path

import pytest

from services.tracker.prior import ship
from services.tracker.prior.file import read_prior
from services.tracker.prior.training import Plan

SMALL = Plan(candidates=(5, 10))


def test_a_prior_of_the_actor_is_learnt_and_the_same_each_time(tmp_path: Path) -> None:
    one, other = (ship.shipped_prior("walking", people=(1,), plan=SMALL) for _ in range(2))
    assert one.training == other.training
    assert one.bases.tobytes() == other.bases.tobytes()
    assert one.training.motions == ("actor-walking-1-1",)
    assert one.training.held == ("actor-walking-5-5",)


def test_the_named_priors_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = ship.shipped_prior("walking", people=(1,), plan=SMALL)
    monkeypatch.setattr(ship, "shipped_prior", lambda kind: small)
    monkeypatch.setattr(sys, "argv", ["ship", "walking", "boxing", "--to", str(tmp_path)])
    ship.main()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["boxing.prior", "walking.prior"]
    assert read_prior(tmp_path / "boxing.prior").regions == small.regions


def test_another_name_is_wrong_usage(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["ship", "swimming"])
    with pytest.raises(SystemExit):
        ship.main()
    assert "swimming: allowed: walking, running, boxing, general" in capsys.readouterr().err
