"""Hits and false alarms of the advice about a camera: one film with a fault and one without."""

from pathlib import Path

import pytest

from benchmarks.cases.rooms.advice import CALM, run
from benchmarks.harness.case import case


@pytest.mark.nightly
def test_a_dark_film_is_named_and_an_ordinary_one_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path))
    only = "empty room first,dark,passes in front"  # the last has a second person, whose path is a function
    found = run(case("dark", only=only))
    assert (found["hits"], found["false alarms"]) == (100.0, 0.0)
    assert found["hits, of"] > 5
    assert run(case(CALM, only=only))["false alarms"] < 10.0
