"""Acting a whole cast: takes, resuming, the manifest."""

import csv
from pathlib import Path

import pytest

from common.formats.poses import read_poses
from services.takes.act.cast import Act, acts
from services.takes.act.shell import COLUMNS, MANIFEST, perform, take_of

ACTS = acts([7], ("squat", "kick-left"), 1)


def quiet(_done: int, _of: int, _words: str) -> None: ...


def test_the_manifest_has_a_row_for_every_take_with_its_posture_in_it(tmp_path: Path) -> None:
    perform(tmp_path, "truth", ACTS, 1, quiet)
    with (tmp_path / MANIFEST).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [(row["posture"], int(row["person"]), int(row["repetition"])) for row in rows] == [
        (one.posture, one.person, one.repetition) for one in ACTS
    ]
    for row in rows:
        times_s = read_poses(tmp_path / row["source"]).times_s
        assert times_s[0] < float(row["start"]) < float(row["end"]) == pytest.approx(times_s[-1], abs=2 / 15)


def test_takes_that_are_there_are_left_as_they_are(tmp_path: Path) -> None:
    there = take_of(tmp_path, "truth", ACTS[0])
    there.write_bytes(b"somebody's")
    told: list[tuple[int, int, str]] = []
    filmed = perform(tmp_path, "truth", ACTS, 1, lambda *news: told.append(news))
    assert [one.act for one in filmed] == [ACTS[1]]
    assert there.read_bytes() == b"somebody's"
    assert told == [(1, 2, ""), (2, 2, ACTS[1].name)]
    assert not list(tmp_path.glob("*.part"))


def test_two_processes_write_the_bytes_of_one(tmp_path: Path) -> None:
    perform(tmp_path / "one", "truth", ACTS, 1, quiet)
    filmed = perform(tmp_path / "two", "truth", ACTS, 2, quiet)
    assert {one.act for one in filmed} == set(ACTS)
    for one in (*map(lambda act: take_of(Path(), "truth", act), ACTS), Path(MANIFEST)):
        assert (tmp_path / "one" / one).read_bytes() == (tmp_path / "two" / one).read_bytes()


def test_an_act_names_its_take() -> None:
    assert take_of(Path("acted"), "hybrid", Act(3, "squat", 1)) == Path("acted/hybrid-3-squat-1.mcap")
