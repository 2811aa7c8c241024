"""`zenocap posture act`: output, files, and rejected arguments."""

from pathlib import Path
from unittest.mock import patch

import pytest

from tests.support.command import printed, zenocap
from zenocap.common.rig.rig import Rig
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.takes.track import Tracked
from zenocap.tools.teach.dataset.generate import Method

pytestmark = pytest.mark.slow
FEW = ("--people", "1", "--postures", "squat, kick-left", "--repetitions", "1", "--method", "truth", "--jobs", "1")


def test_second_run_keeps_existing_takes_and_manifest(tmp_path: Path) -> None:
    assert f"{tmp_path / 'manifest.csv'}: 2 takes, 2 new" in printed("posture", "act", "-o", tmp_path, *FEW)
    rows = read_manifest(tmp_path / "manifest.csv")
    assert [row.posture for row in rows] == ["squat", "kick-left"]
    assert all(row.source.is_file() for row in rows)
    assert "2 takes, 0 new" in printed("posture", "act", "-o", tmp_path, *FEW)


def test_people_seed_selects_the_simulated_people(tmp_path: Path) -> None:
    printed("posture", "act", "-o", tmp_path, "--people-seed", "2", *FEW)
    assert {row.person for row in read_manifest(tmp_path / "manifest.csv")} == {"24"}


def test_take_without_poses_is_reported_with_exit_status_3(tmp_path: Path) -> None:
    def generate_without_poses(_rig: Rig, _method: Method, script: MotionTimeline, _room: int, take: Path) -> Tracked:
        take.write_bytes(b"")
        return Tracked(60, 0, 2, (), {})

    with patch("zenocap.tools.teach.dataset.batch.generate_take", generate_without_poses):
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
def test_invalid_option_is_rejected_with_the_allowed_values(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    assert words in " ".join(printed("posture", "act", "-o", tmp_path / "acted", *options, status=2).split())
    assert not (tmp_path / "acted").exists()
