"""The numbered examples run, are short, and are shown in the documentation."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import CLIPS, ROOT

EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
PAGE = ROOT / "docs" / "examples.md"


def run(name: str, *arguments: str | Path) -> str:
    (path,) = (ROOT / "examples").glob(f"{name}_*.py")
    result = subprocess.run([sys.executable, path, *map(str, arguments)], capture_output=True, text=True, timeout=280)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Take written by the first example."""
    path = tmp_path_factory.mktemp("examples") / "demo.mcap"
    words = run("01", path)
    assert "567 poses at 15.0 frames/s" in words
    assert "highest right hand: " in words
    return path


def test_there_are_eleven_examples() -> None:
    assert [path.name[:2] for path in EXAMPLES] == [f"{number:02}" for number in range(1, 12)]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short_and_shown_in_the_documentation(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 40
    assert f"```python\n{text.rstrip()}\n```" in PAGE.read_text(encoding="utf-8")


@pytest.mark.slow
def test_joint_angles_are_plotted(take: Path, tmp_path: Path) -> None:
    run("03", take, tmp_path / "knees.png")
    assert (tmp_path / "knees.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_take_is_read_in_chunks(take: Path) -> None:
    assert "path length of the navel over the ground: " in run("04", take)


@pytest.mark.slow
def test_a_take_is_exported(take: Path) -> None:
    run("05", take)
    for suffix in (".bvh", ".trc", ".csv"):
        assert take.with_suffix(suffix).stat().st_size > 10_000


@pytest.mark.slow
def test_a_rig_file_is_written_and_tracked(tmp_path: Path) -> None:
    words = run("08", tmp_path / "arms")
    assert "rig arms: method hybrid, viewers 1, 2" in words
    assert (tmp_path / "arms" / "arms.mcap").is_file()


@pytest.mark.slow
def test_walking_speed_is_plausible(take: Path) -> None:
    words = run("09", take)
    highest = float(words.split("highest ")[1].split(" ")[0])
    assert 0.3 < highest < 3.0


@pytest.mark.slow
@pytest.mark.clips
def test_a_folder_of_videos_is_tracked(tmp_path: Path) -> None:
    if not CLIPS.is_dir():
        pytest.skip("the shared clips are not beside the checkout")
    assert "poses, " in run("02", CLIPS / "walk2", tmp_path / "walk.mcap")


@pytest.mark.slow
def test_missing_folder_is_one_error_line(tmp_path: Path) -> None:
    (path,) = (ROOT / "examples").glob("02_*.py")
    arguments = [sys.executable, path, tmp_path / "none", tmp_path / "x.mcap"]
    result = subprocess.run(arguments, capture_output=True, text=True)
    assert result.returncode == 1
    assert result.stderr.startswith("error: ")
    assert len(result.stderr.splitlines()) == 1
