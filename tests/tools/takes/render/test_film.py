"""Films and pictures of takes: times, golden pictures, complete files only, clear errors."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.command import zenocap
from tests.support.places import GOLDEN
from tests.support.pose_tracks import moving
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound
from zenocap.common.video.film_writer import Codec
from zenocap.tools.takes.render.camera_path import Shot
from zenocap.tools.takes.render.film import RenderedFilm, RenderOptions, render

COUNT, LOST = 30, tuple(range(10, 20))  # longer than the 0.25 s that are interpolated
SMALL = (160, 96)


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    messages = messages_of_track(moving(COUNT, lost=LOST, rate=30.0))
    return write_take(tmp_path_factory.mktemp("takes") / "walk.mcap", messages)


def frames_of(path: Path) -> tuple[list[np.ndarray], float]:
    film = cv2.VideoCapture(str(path))
    frames = []
    while True:
        there, frame = film.read()
        if not there:
            return frames, film.get(cv2.CAP_PROP_FPS)
        frames.append(frame)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "codec"), [("walk.mp4", None), ("walk.mp4", "vp9"), ("walk.mp4", "mpeg4"), ("walk.webm", None)]
)
def test_a_film_has_one_picture_per_instant(name: str, codec: Codec | None, take: Path, tmp_path: Path) -> None:
    output = tmp_path / name
    seen: list[tuple[int, int]] = []
    wishes = RenderOptions(size=SMALL, codec=codec, trails_s=0.2)
    assert render(take, output, wishes, lambda done, total: seen.append((done, total))) == RenderedFilm(
        COUNT, len(LOST), None
    )
    frames, fps = frames_of(output)
    assert (len(frames), fps) == (COUNT, pytest.approx(30.0))
    assert frames[0].shape == (SMALL[1], SMALL[0], 3)
    assert seen == [(k + 1, COUNT) for k in range(COUNT)]
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.slow
def test_a_film_of_a_time_range_at_another_frame_rate(take: Path, tmp_path: Path) -> None:
    wishes = RenderOptions(Bound(0.1, True), Bound(9), fps=60.0, size=SMALL, shot=Shot("front", True, 1.0))
    assert render(take, tmp_path / "a.mp4", wishes).pictures == 13  # 0.1 s to 0.3 s
    assert len(frames_of(tmp_path / "a.mp4")[0]) == 13


@pytest.mark.slow
def test_a_picture_shows_the_first_pose_or_several(take: Path, tmp_path: Path) -> None:
    one = RenderOptions(size=SMALL, shot=Shot("front"))
    render(take, tmp_path / "one.png", one)
    render(take, tmp_path / "many.png", RenderOptions(size=SMALL, shot=Shot("front"), poses=4))
    render(take, tmp_path / "trail.png", RenderOptions(size=SMALL, shot=Shot("front"), poses=4, trails_s=9.0))
    first, many, trail = (cv2.imread(str(tmp_path / name)) for name in ("one.png", "many.png", "trail.png"))
    assert first.shape == many.shape == trail.shape == (SMALL[1], SMALL[0], 3)
    assert (first != many).any()
    assert (many != trail).any()


def test_the_same_take_gives_the_same_picture(take: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        render(take, tmp_path / name, RenderOptions(size=SMALL))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.slow
def test_errors_name_the_option_and_what_is_allowed(take: Path, tmp_path: Path) -> None:
    for output, wishes, text in (
        ("a.gif", RenderOptions(), r"a\.gif: allowed: a file name that ends in \.mp4, \.webm, \.webp, \.png, \.jpg"),
        ("a.png", RenderOptions(shot=Shot("7")), r"--view '7': allowed: front, .*, or a viewer: 1"),
        ("a.png", RenderOptions(Bound(12), Bound(15)), "lost in every selected frame"),
        ("a.png", RenderOptions(Bound(99)), "leave no frame: allowed: frames 0 to 29"),
        ("/dev/null/a.png", RenderOptions(size=SMALL), "cannot be written"),
        ("/proc/a.mp4", RenderOptions(size=SMALL), r"proc/a\.mp4: cannot be written"),
    ):
        with pytest.raises(UserError, match=text):
            render(take, tmp_path / output, wishes)
    with pytest.raises(UserError, match="no MCAP file"):
        render(Path(__file__), tmp_path / "a.png", RenderOptions())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_an_interrupted_film_leaves_the_previous_file(take: Path, tmp_path: Path) -> None:
    output = tmp_path / "a.mp4"
    output.write_bytes(b"before")

    def interrupted(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render(take, output, RenderOptions(size=SMALL), interrupted)
    assert output.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.nightly
def test_the_render_command(take: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("render", take, "-o", tmp_path / "a.mp4", "--size", "160x96", "--theme", "dark")
    assert status == 0
    assert all(line.startswith("drawing: ") for line in err.splitlines())  # progress, after 10 s
    assert out == f"{tmp_path / 'a.mp4'}: 30 pictures, 10 of them without a person\n"
    status, out, _ = zenocap("render", take, "-o", tmp_path / "a.png", "--size", "160x96", "--no-captions")
    assert (status, out) == (0, f"{tmp_path / 'a.png'}: 1 picture\n")


@pytest.mark.slow
def test_the_render_command_refuses_invalid_values(take: Path, tmp_path: Path) -> None:
    for size in ("100", "161x96", "32x32", "99999x100"):
        status, _, err = zenocap("render", take, "-o", tmp_path / "a.png", "--size", size)
        assert status == 2
        assert "allowed: WIDTHxHEIGHT, both even, from 64 to 8192" in " ".join(err.split())
    status, _, err = zenocap("render", take, "-o", tmp_path / "a.gif")
    assert (status, err.count("\n")) == (1, 1)
    status, _, err = zenocap("animator", take)
    assert (status, err) == (1, f"error: {take} is a take; zenocap show {take} shows it\n")


@pytest.mark.slow
def test_a_truncated_take_is_rendered_as_far_as_it_can_be_read(take: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(take.read_bytes()[:-40])
    status, _, err = zenocap("render", cut, "-o", tmp_path / "a.png", "--size", "160x96")
    assert status == 3
    assert err.startswith(f"lost: {cut}: ")


PICTURE = (320, 240)
LEVELS = 2  # grey levels by which a picture may differ
STORED = {
    "light": RenderOptions(first=Bound(60), size=PICTURE, trails_s=1.0, poses=3),
    "dark": RenderOptions(first=Bound(60), size=PICTURE, theme="dark", shot=Shot("front"), captions=False),
    "viewer": RenderOptions(first=Bound(60), size=PICTURE, shot=Shot("1")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_a_picture_is_the_golden_one(name: str, tmp_path: Path) -> None:
    render(GOLDEN / "arms.mcap", tmp_path / "a.png", STORED[name])
    found = cv2.imread(str(tmp_path / "a.png")).astype(int)
    expected = cv2.imread(str(Path(__file__).parent / f"golden-{name}.png")).astype(int)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= LEVELS
