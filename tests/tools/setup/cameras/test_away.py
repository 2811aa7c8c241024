"""Videos that are still on other machines: named with the commands that copy them."""

import shlex
import shutil
from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board_films import board_films
from zenocap.tools.setup.cameras.away import AWAY, copy_commands, detect_commands, require_copied, write_away

PLACES = {"cam01": ("lab1", '/home/a "b"/films/x'), "cam02": ("lab2", "/home/c/films/x")}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A film whose videos are away."""
    (tmp_path / "my walk" / "videos").mkdir(parents=True)
    require_copied(tmp_path / "my walk")  # nothing is away yet
    write_away(tmp_path / "my walk", PLACES)
    return tmp_path / "my walk"


def test_missing_videos_are_named_until_they_are_copied(folder: Path) -> None:
    with pytest.raises(UserError, match="cam01 on lab1, cam02 on lab2: allowed: all videos in the folder"):
        board_films([folder])
    (folder / "times").mkdir()
    for name in ("videos/cam01.mkv", "videos/cam02.MP4", "times/cam01.csv"):  # an interrupted copy leaves half a video
        (folder / name).touch()
    with pytest.raises(UserError, match="cameras: cam02 on lab2: ") as caught:
        require_copied(folder)
    lines = [line.strip() for line in str(caught.value).splitlines()[1:]]
    assert lines[1:] == copy_commands(folder, {"cam02": PLACES["cam02"]})
    (folder / "times" / "cam02.csv").touch()
    require_copied(folder)
    write_away(folder, {})
    assert not (folder / AWAY).exists()


def test_the_commands_copy_videos_and_times(tmp_path: Path) -> None:
    """With `cp` in place of `scp`, and no machine before the colon."""
    there, here = tmp_path / "th ere", tmp_path / "he re"
    for place in (there, here):
        for part in ("videos", "times"):
            (place / part).mkdir(parents=True)
    (there / "videos" / "cam01.mkv").write_bytes(b"video")
    (there / "times" / "cam01.csv").write_bytes(b"times")
    for command in copy_commands(here, {"cam01": ("lab1", str(there))}):
        program, end, source, target = shlex.split(command)
        assert (program, end) == ("scp", "--")
        shutil.copy(source.removeprefix("lab1:"), target)
    assert (here / "videos" / "cam01.mkv").read_bytes() == b"video"
    assert (here / "times" / "cam01.csv").read_bytes() == b"times"


def test_corners_do_in_place_of_videos_for_a_board_only(folder: Path) -> None:
    (folder / "times").mkdir()
    for name in ("videos/cam01.mkv", "times/cam01.csv"):
        (folder / name).touch()
    with pytest.raises(UserError, match="cam02 on lab2: allowed: all videos in the folder; copy them") as caught:
        board_films([folder])
    text = str(caught.value)
    assert "or the corners of the board, detected there, in place of videos:\n" in text
    missing = {"cam02": PLACES["cam02"]}
    for command in (*copy_commands(folder, missing), *detect_commands(folder, missing)):
        assert f"\n  {command}" in text
    (folder / "corners").mkdir()
    (folder / "corners" / "cam02.corners").touch()
    require_copied(folder, corners=True)
    with pytest.raises(UserError) as caught:
        require_copied(folder)
    assert "detected there" not in str(caught.value)


def test_the_commands_detect_once_in_each_place_and_copy_the_corners(tmp_path: Path) -> None:
    """Read as a shell does, on this machine and on the other."""
    places = {"cam01": ("lab1", "/home/a b/films/x"), "cam02": ("lab1", "/home/a b/films/x"), "cam03": ("-lab", "/f")}
    lines = [shlex.split(line) for line in detect_commands(tmp_path / "th is", places)]
    assert lines[0] == ["mkdir", "-p", str(tmp_path / "th is" / "corners")]
    assert [words[:3] for words in lines[1:3]] == [["ssh", "--", "lab1"], ["ssh", "--", "-lab"]]
    assert shlex.split(lines[1][3]) == ["zenocap", "calibrate", "detect", "/home/a b/films/x", "--square", "MM"]
    target = f"{tmp_path / 'th is' / 'corners'}/"
    assert lines[3] == ["scp", "--", "lab1:/home/a b/films/x/corners/cam01.corners", target]
    assert lines[-1][:3] == ["scp", "--", "-lab:/f/corners/cam03.corners"]  # a name that would be an option
    assert len(lines) == 6


def test_a_damaged_list_is_refused(tmp_path: Path) -> None:
    (tmp_path / AWAY).write_text("[away]\ncam01 = 3\n")
    with pytest.raises(UserError, match=r"away.toml: away.cam01 = 3: allowed: \[machine, folder\]"):
        require_copied(tmp_path)
