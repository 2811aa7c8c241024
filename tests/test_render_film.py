"""Films and pictures of takes: as many pictures as there are instants, whole files only, errors in words."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from common.formats.track import Bound
from common.formats.trc import FormatError
from common.take.reading import TakeError
from services.animator.render.film import Rendered, Wishes, render
from services.animator.render.path import Shot
from services.cli import app
from tests.pose_tracks import moving
from tests.test_poses import said_of, write_take

COUNT, LOST = 30, tuple(range(10, 20))  # longer than what is bridged, 0.25 s
SMALL = (160, 96)


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    said = said_of(moving(COUNT, lost=LOST, rate=30.0))
    return write_take(tmp_path_factory.mktemp("takes") / "walk.mcap", said)


def frames_of(path: Path) -> tuple[list[np.ndarray], float]:
    film = cv2.VideoCapture(str(path))
    frames = []
    while True:
        there, frame = film.read()
        if not there:
            return frames, film.get(cv2.CAP_PROP_FPS)
        frames.append(frame)


def zenocap(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200", "NO_COLOR": "1"})
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize("codec", ["vp9", "mpeg4"])
def test_a_film_has_a_picture_for_every_instant(codec: str, take: Path, tmp_path: Path) -> None:
    output = tmp_path / "walk.mp4"
    seen: list[tuple[int, int]] = []
    wishes = Wishes(size=SMALL, codec="vp9" if codec == "vp9" else "mpeg4", trails_s=0.2)
    assert render(take, output, wishes, lambda done, of: seen.append((done, of))) == Rendered(COUNT, len(LOST), None)
    frames, fps = frames_of(output)
    assert (len(frames), fps) == (COUNT, pytest.approx(30.0))
    assert frames[0].shape == (SMALL[1], SMALL[0], 3)
    assert seen == [(k + 1, COUNT) for k in range(COUNT)]
    assert [path.name for path in tmp_path.iterdir()] == ["walk.mp4"]


def test_at_another_rate_from_one_moment_to_another(take: Path, tmp_path: Path) -> None:
    wishes = Wishes(Bound(0.1, True), Bound(9), fps=60.0, size=SMALL, shot=Shot("front", True, 1.0))
    assert render(take, tmp_path / "a.mp4", wishes).pictures == 13  # 0.1 s to 0.3 s
    assert len(frames_of(tmp_path / "a.mp4")[0]) == 13


def test_a_picture_shows_the_first_pose_or_several(take: Path, tmp_path: Path) -> None:
    one = Wishes(size=SMALL, shot=Shot("front"))
    render(take, tmp_path / "one.png", one)
    render(take, tmp_path / "many.png", Wishes(size=SMALL, shot=Shot("front"), poses=4))
    render(take, tmp_path / "trail.png", Wishes(size=SMALL, shot=Shot("front"), poses=4, trails_s=9.0))
    first, many, trail = (cv2.imread(str(tmp_path / name)) for name in ("one.png", "many.png", "trail.png"))
    assert first.shape == many.shape == trail.shape == (SMALL[1], SMALL[0], 3)
    assert (first != many).any()
    assert (many != trail).any()


def test_the_same_take_gives_the_same_picture(take: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        render(take, tmp_path / name, Wishes(size=SMALL))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_errors_in_words(take: Path, tmp_path: Path) -> None:
    for output, wishes, text in (
        (tmp_path / "a.gif", Wishes(), r"a\.gif: allowed: a file that ends in \.mp4, \.png, \.jpg"),
        (tmp_path / "a.png", Wishes(shot=Shot("7")), r"--view '7': allowed: front, .*, or a viewer: 1"),
        (tmp_path / "a.png", Wishes(Bound(12), Bound(15)), "lost in every frame that is wanted"),
        (tmp_path / "a.png", Wishes(Bound(99)), "leave no frame: allowed: frames 0 to 29"),
    ):
        with pytest.raises(FormatError, match=text):
            render(take, output, wishes)
    with pytest.raises(TakeError, match="no MCAP file"):
        render(Path(__file__), tmp_path / "a.png", Wishes())
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(FormatError, match="cannot be written"):
        render(take, tmp_path / "file" / "a.png", Wishes(size=SMALL))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_failure_on_the_way_leaves_the_film_that_was_there(take: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.mp4"
    output.write_bytes(b"before")

    def interrupted(done: int, of: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render(take, output, Wishes(size=SMALL), interrupted)
    assert output.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_the_command(take: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("animator", take, "--render", tmp_path / "a.mp4", "--size", "160x96", "--look", "dark")
    assert (status, err) == (0, "")
    assert out == f"{tmp_path / 'a.mp4'}: 30 pictures, 10 of them without the person\n"
    status, out, _ = zenocap("animator", take, "--render", tmp_path / "a.png", "--size", "160x96", "--no-captions")
    assert (status, out) == (0, f"{tmp_path / 'a.png'}: 1 picture\n")


def test_the_command_refuses_what_cannot_be(take: Path, tmp_path: Path) -> None:
    for size in ("100", "161x96", "32x32", "99999x100"):
        status, _, err = zenocap("animator", take, "--render", tmp_path / "a.png", "--size", size)
        assert status == 2
        assert "allowed: WIDTHxHEIGHT, both even, from 64 to 8192" in " ".join(err.split())
    status, _, err = zenocap("animator", take, "--render", tmp_path / "a.gif")
    assert (status, err.count("\n")) == (1, 1)
    status, _, err = zenocap("animator", take)
    assert status == 2
    assert "is a take: allowed with --render" in " ".join(err.replace("│", "").split())


def test_a_cut_take_is_drawn_as_far_as_it_goes(take: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(take.read_bytes()[:-40])
    status, _, err = zenocap("animator", cut, "--render", tmp_path / "a.png", "--size", "160x96")
    assert status == 3
    assert err.startswith(f"lost: {cut}: ")
