"""`make priors` with fewer people and regions than for the built-in priors."""

import sys
from pathlib import Path

import pytest

from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.prior.training import TrainingPlan
from zenocap.tools.teach.dataset import build_priors

pytestmark = pytest.mark.slow

SMALL = TrainingPlan(candidates=(5, 10))


@pytest.mark.nightly
def test_training_a_prior_on_simulated_motion_is_repeatable(tmp_path: Path) -> None:
    one, other = (build_priors.shipped_prior("walking", people=(1,), plan=SMALL) for _ in range(2))
    assert one.training == other.training
    assert one.bases.tobytes() == other.bases.tobytes()
    assert one.training.motions == ("actor-walking-1-1",)
    assert one.training.held == ("actor-walking-5-5",)


@pytest.mark.nightly
def test_requested_priors_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = build_priors.shipped_prior("walking", people=(1,), plan=SMALL)
    monkeypatch.setattr(build_priors, "shipped_prior", lambda kind: small)
    monkeypatch.setattr(sys, "argv", ["build_priors", "walking", "boxing", "--to", str(tmp_path)])
    build_priors.main()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["boxing.prior", "walking.prior"]
    assert read_prior(tmp_path / "boxing.prior").regions == small.regions


def test_unknown_prior_name_is_wrong_usage(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["build_priors", "swimming"])
    with pytest.raises(SystemExit):
        build_priors.main()
    assert "swimming: allowed: walking, running, boxing, general" in capsys.readouterr().err
