"""Acting a whole cast: takes, resuming, the manifest."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from common.actor.script import Script
from common.formats.poses import read_poses
from common.runtime.rig import Rig
from services.recognizer.features import DEFAULT
from services.recognizer.manifest import read_manifest
from services.recognizer.reading import examples_of
from services.takes.act.cast import Act, acts
from services.takes.act.shell import MANIFEST, perform, take_of
from services.takes.act.stage import Method, act
from services.takes.track import Tracked

ACTS = acts([7], ("squat", "kick-left"), 1)


def quiet(_done: int, _of: int, _words: str) -> None: ...


def test_the_manifest_has_a_row_for_every_take_with_its_posture_in_it(tmp_path: Path) -> None:
    perform(tmp_path, "truth", ACTS, 1, quiet)
    rows = read_manifest(tmp_path / MANIFEST)
    assert [(row.posture, row.person, row.repetition) for row in rows] == [
        (one.posture, str(one.person), str(one.repetition)) for one in ACTS
    ]
    for row in rows:
        times_s = read_poses(row.source).times_s
        assert row.start is not None
        assert row.end is not None
        assert times_s[0] < row.start < row.end == pytest.approx(times_s[-1], abs=2 / 15)


def test_the_postures_of_the_manifest_can_be_learnt_from(tmp_path: Path) -> None:
    perform(tmp_path, "truth", ACTS, 1, quiet)
    manifest = tmp_path / MANIFEST
    examples = examples_of(manifest, read_manifest(manifest), DEFAULT)
    assert [example.label for example in examples] == [one.posture for one in ACTS]
    assert all(np.isfinite(example.features).all() for example in examples)


def test_a_take_without_poses_is_told_of_and_not_in_the_manifest(tmp_path: Path) -> None:
    def nobody(_rig: Rig, _method: Method, _script: Script, _room: int, take: Path) -> Tracked:
        take.write_bytes(b"")
        return Tracked(60, 0, 2, (), {})

    with patch("services.takes.act.shell.act", nobody):
        filmed = perform(tmp_path, "truth", ACTS[:1], 1, quiet)
    assert [one.poses for one in filmed] == [0]
    assert [one.act for one in perform(tmp_path, "truth", ACTS, 1, quiet)] == ACTS[1:], "it is not tried again"
    assert [row.posture for row in read_manifest(tmp_path / MANIFEST)] == [ACTS[1].posture]


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


def test_two_commands_on_one_folder_do_not_take_each_others_unfinished_takes(tmp_path: Path) -> None:
    parts: list[Path] = []

    def filming(rig: Rig, method: Method, script: Script, room: int, take: Path) -> Tracked:
        parts.append(take)
        return act(rig, method, script, room, take)

    for process in (1, 2):
        with (
            patch("services.takes.act.shell.act", filming),
            patch("services.takes.act.shell.os.getpid", return_value=process),
        ):
            perform(tmp_path, "truth", ACTS[process - 1 : process], 1, quiet)
            take_of(tmp_path, "truth", ACTS[process - 1]).unlink()
            perform(tmp_path, "truth", ACTS[:1], 1, quiet)
            take_of(tmp_path, "truth", ACTS[0]).unlink()
    assert len({part for part in parts if ACTS[0].name in part.name}) == 2
