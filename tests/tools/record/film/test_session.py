"""Description of a film, and what to do next with it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from zenocap.common.messages import FilmBoard
from zenocap.common.rig.rig import demo_rig
from zenocap.tools.record.film.camera import Filmed
from zenocap.tools.record.film.remote_film import NOBODY, RemoteFilm
from zenocap.tools.record.film.session import FilmRequest, FilmResult, lines_of, next_lines

RIG = demo_rig()
BOARD = FilmBoard(kind="charuco", columns=5, rows=7, square_mm=35.0, marker_mm=None, dictionary=None, spacing=None)
WHOLE = [Filmed(viewer.camera.name, 31, 10**9, 2 * 10**9) for viewer in RIG.viewers]
NAMES = [one.name for one in WHOLE]
FIRST = f"{NAMES[0]}: 31 frames, 30.00 frames/s"


def away(folder: Path) -> RemoteFilm:
    """The first camera is filmed by another machine, whose clock is not known."""
    reply = SimpleNamespace(frames=31, host="hall", folder=str(folder))
    place = SimpleNamespace(running=False)
    return RemoteFilm([SimpleNamespace(name=NAMES[0], host="hall", reply=reply, clock=None, place=place)])


def result(folder: Path, *, is_rig: bool = True, board: FilmBoard | None = None) -> FilmResult:
    request = FilmRequest(folder, RIG if is_rig else None, RIG.viewers, board=board)
    return FilmResult(request, WHOLE, NOBODY, "", {}, ())


def test_a_whole_film_has_a_line_for_each_camera(tmp_path: Path) -> None:
    found = result(tmp_path)
    assert found.is_whole
    assert list(lines_of(found)) == [(f"{name}: 31 frames, 30.00 frames/s", False) for name in NAMES]


@pytest.mark.parametrize(
    ("changes", "line", "is_warning"),
    [
        ({"filmed": [replace(WHOLE[0], lost=2)]}, f"{FIRST}, 2 frames lost by the writer", False),
        ({"filmed": [replace(WHOLE[0], away=1)]}, f"{FIRST}, lost and opened again: 1", False),
        ({"filmed": [Filmed(NAMES[0])]}, f"{NAMES[0]}: 0 frames, 0.00 frames/s, no frame", False),
        ({"failures": ["cam09: not copied: cut"]}, "cam09: not copied: cut", True),
        ({"reason": "the disk is nearly full"}, "ended early: the disk is nearly full", True),
    ],
)
def test_losses_are_stated(changes: dict[str, object], line: str, is_warning: bool, tmp_path: Path) -> None:
    found = replace(result(tmp_path), **changes)
    assert not found.is_whole
    assert (line, is_warning) in list(lines_of(found))


def test_the_next_command_is_that_of_the_film(tmp_path: Path) -> None:
    folder = tmp_path / "monday"
    assert next_lines(result(folder), "--square MM") == [f"next: zenocap track {folder} -o monday.mcap"]
    for one in (result(folder, is_rig=False), result(folder, board=BOARD)):
        assert next_lines(one, "--square 35") == [f"next: zenocap calibrate board {folder} --square 35"]


def test_videos_on_other_machines_are_copied_or_their_board_is_detected_there(tmp_path: Path) -> None:
    there = Path("/films/monday")
    first, *commands = next_lines(replace(result(tmp_path), remote=away(there)), "--square MM")
    assert first == f"next: copy videos/ and times/ of {NAMES[0]} into {tmp_path}, then zenocap track {tmp_path}"
    assert [line.split()[:3] for line in commands] == [
        ["scp", "--", f"hall:{there}/{part}/{NAMES[0]}.{suffix}"] for part, suffix in (("videos", "mkv"), ("times", "csv"))
    ]
    first, *commands = next_lines(replace(result(tmp_path, is_rig=False), remote=away(there)), "--square MM")
    assert first.startswith(
        f"next: detect the board of {NAMES[0]} where the videos are, and copy the corners into {tmp_path}"
    )
    assert any(f"zenocap calibrate detect {there} --square MM" in line for line in commands)
    assert "or copy the videos:" in commands


def test_a_film_that_was_moved_here_is_not_away(tmp_path: Path) -> None:
    found = replace(result(tmp_path), remote=away(Path("/films/monday")))
    assert found.away() == {NAMES[0]: ("hall", "/films/monday")}
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / f"{NAMES[0]}.mkv").touch()
    assert found.away() == {}
