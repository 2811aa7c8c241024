"""Hits and false alarms of camera advice in a film with a fault and one without."""

import sys

import pytest

from benchmarks.rooms import advice


@pytest.mark.nightly
def test_a_dark_film_is_named_and_an_ordinary_one_is_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    only = "empty room first,dark,passes in front"  # the last has a second person, whose path is a function
    monkeypatch.setattr(sys, "argv", ["advice", "--seeds", "1", "--sizes", "160x120", "--only", only])
    advice.main()
    rows = [[cell.strip() for cell in line.split("|")] for line in capsys.readouterr().out.splitlines()]
    (dark,) = [row for row in rows if row[1:2] == ["dark"]]
    assert dark[2].startswith("100 % of ")
    assert dark[3].startswith("0.0 % of ")
