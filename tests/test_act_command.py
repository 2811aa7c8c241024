"""`zenocap posture act`: what it says, what it leaves, and what it refuses."""

from pathlib import Path
from unittest.mock import patch

import pytest

from common.actor.script import Script
from common.runtime.rig import Rig
from services.recognizer.manifest import read_manifest
from services.takes.act.stage import Method
from services.takes.track import Tracked
from tests.test_cli import zenocap

FEW = ("--people", "1", "--postures", "squat, kick-left", "--repetitions", "1", "--method", "truth", "--jobs", "1")


def test_takes_and_their_manifest_are_there_and_stay_when_it_is_started_again(tmp_path: Path) -> None:
    status, out, err = zenocap("posture", "act", "-o", tmp_path, *FEW)
    assert status == 0, err
    assert f"{tmp_path / 'manifest.csv'}: 2 takes, 2 of them new" in out
    rows = read_manifest(tmp_path / "manifest.csv")
    assert [row.posture for row in rows] == ["squat", "kick-left"]
    assert all(row.source.is_file() for row in rows)
    assert "2 takes, 0 of them new" in zenocap("posture", "act", "-o", tmp_path, *FEW)[1]


def test_who_acts_is_chosen_by_the_seed(tmp_path: Path) -> None:
    status, _, err = zenocap("posture", "act", "-o", tmp_path, "--people-seed", "2", *FEW)
    assert status == 0, err
    assert {row.person for row in read_manifest(tmp_path / "manifest.csv")} == {"24"}


def test_a_take_without_poses_is_named_and_the_exit_status_says_so(tmp_path: Path) -> None:
    def nobody(_rig: Rig, _method: Method, script: Script, _room: int, take: Path) -> Tracked:
        take.write_bytes(b"")
        return Tracked(60, 0, 2, (), {})

    with patch("services.takes.act.shell.act", nobody):
        status, _, err = zenocap("posture", "act", "-o", tmp_path, *FEW)
    assert status == 3
    assert err.count("lost: ") == 2
    assert "no pose" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--postures", "squat,handstand"), "handstand: allowed: "),
        (("--people", "0"), "should be greater than or equal to 1"),
        (("--method", "magic"), "two-view"),
    ],
)
def test_what_there_is_not_is_refused_with_what_is_allowed(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    status, _, err = zenocap("posture", "act", "-o", tmp_path / "acted", *options)
    assert status == 2
    assert words in " ".join(err.split())
    assert not (tmp_path / "acted").exists()
