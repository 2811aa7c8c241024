"""`calibrate detect`: the calibration of the videos, bit for bit; wrong calls."""

import json
import shutil
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.support.board_films import board_videos
from tests.support.board_views import places, rig_error_m
from tests.support.command import printed, zenocap
from tests.support.stored import stored_files
from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.tools.setup.calibration import corners_file, detection
from zenocap.tools.setup.calibration.board_films import board_films

pytestmark = pytest.mark.slow
BOARD = ("--square", "200")
detect = partial(printed, "calibrate", "detect")


@pytest.fixture(scope="module")
def films(tmp_path_factory) -> Path:
    """A folder with videos, the beginnings of both, and a file with the lenses."""
    return stored_files(tmp_path_factory.mktemp("board"), make_films, "detect", sources=[__name__])


def make_films(folder: Path) -> None:
    cameras = board_videos(folder)
    (folder / "sync.toml").write_text("[offset_s]\ncam01 = 0.0\ncam02 = 0.02\n")
    write_calibration(folder / "lenses.toml", {one.name: one for one in cameras})
    write_calibration(folder / "truth.toml", {one.name: one for one in cameras})


@pytest.fixture(scope="module")
def machines(films, tmp_path_factory) -> list[Path]:
    """A folder for each camera, as on its own machine, with the corners that were detected there."""
    folders = []
    for name in ("cam01", "cam02"):
        folder = tmp_path_factory.mktemp(name)
        (folder / "videos").mkdir()
        shutil.copy(films / "videos" / f"{name}.mp4", folder / "videos")
        output = detect(folder, *BOARD)
        for text in (f"{name}: ", " of 70 images show the board, in ", f"written: {folder}/corners/{name}.corners, 0.0 MB"):
            assert text in output
        folders.append(folder)
    return folders


@pytest.mark.nightly
def test_the_calibration_is_that_from_the_videos_bit_for_bit(films, machines, tmp_path):
    def calibrated(folder: Path, output: Path) -> dict[str, object]:
        options = (*BOARD, "--lenses", films / "lenses.toml", "--floor", "6", "--json", "-o", output)
        status, text, errors = zenocap("calibrate", "board", folder, *options)
        assert status in (0, 3), errors
        return json.loads(text[text.index("{") :]) | {"written": ""}

    of_videos = calibrated(films, tmp_path / "videos.toml")
    found, truth = (list(read_calibration(path).values()) for path in (tmp_path / "videos.toml", films / "truth.toml"))
    assert rig_error_m(found, truth, places()) < 0.01
    assert of_videos["cameras"][1]["delay_s"] != 0.0
    mixed, alone = tmp_path / "mixed", tmp_path / "alone"
    for folder in (mixed, alone):
        (folder / "corners").mkdir(parents=True)
        shutil.copy(films / "sync.toml", folder)
        shutil.copy(machines[1] / "corners" / "cam02.corners", folder / "corners")
    shutil.copy(machines[0] / "corners" / "cam01.corners", alone / "corners")
    (mixed / "videos").mkdir()
    shutil.copy(films / "videos" / "cam01.mp4", mixed / "videos")
    for folder in (mixed, alone):
        assert calibrated(folder, folder / "calibration.toml") == of_videos
        assert (folder / "calibration.toml").read_bytes() == (tmp_path / "videos.toml").read_bytes()


def test_corner_files_hold_no_picture(films, machines):
    for folder in machines:
        (path,) = (folder / "corners").iterdir()
        assert path.stat().st_size < 50_000
        assert path.stat().st_size < (films / "videos" / f"{path.stem}.mp4").stat().st_size / 10


def test_another_board_is_refused(machines, tmp_path):
    files = [folder / "corners" / f"{name}.corners" for folder, name in zip(machines, ("cam01", "cam02"), strict=True)]
    output = printed("calibrate", "board", *files, "--square", "198", "-o", tmp_path / "a.toml", status=1)
    assert "cam01.corners: board.square_m = 0.2: allowed: 0.198, as in the options" in output
    assert not (tmp_path / "a.toml").exists()


def test_existing_corners_are_kept_without_force_and_json_names_them(machines, tmp_path):
    folder = machines[0]
    assert "exists already: allowed: another name, or --force" in detect(folder, *BOARD, status=1)
    output = detect(folder, *BOARD, "--json", "-o", tmp_path / "there")
    (camera,) = json.loads(output[output.index("{") :])["cameras"]
    assert (camera["name"], camera["images"]) == ("cam01", 70)
    assert camera["views"] > 30
    assert camera["written"] == str(tmp_path / "there" / "cam01.corners")
    assert board_films([tmp_path / "there"])[0][0].name == "cam01"


def test_corners_that_are_beside_others_lose_no_other_film(films, tmp_path, monkeypatch):
    """The first of two ended the command, and the second was not searched."""

    def searched(board, path, name, report):
        if name == "cam01":
            (tmp_path / "cam01.corners").write_text("mine")
        return SimpleNamespace(camera=name, looks=70, most=SimpleNamespace(views=[], coverage=0.5))

    monkeypatch.setattr(detection, "detected", searched)
    monkeypatch.setattr(corners_file, "write_corners", lambda path, one, new: write_atomically(path, b"corners", new=new))
    output = detect(films, *BOARD, "-o", tmp_path, status=1)
    beside = tmp_path / "cam01-2.corners"
    assert output.endswith(
        f"error: {tmp_path / 'cam01.corners'}: exists since a moment ago, and stays: the result is in {beside}\n"
    )
    assert f"written: {tmp_path / 'cam02.corners'}" in output
    assert (tmp_path / "cam01.corners").read_text() == "mine"
    assert beside.read_text() == (tmp_path / "cam02.corners").read_text() == "corners"


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [(("--square", "0.1"), 1, "--square 0.1: allowed: the side of a square, 2 to 1000 mm"), ((), 2, "--square")],
)
def test_wrong_options_are_refused(films, tmp_path, arguments, status, text):
    assert text in detect(films, *arguments, "-o", tmp_path, status=status)
    assert not list(tmp_path.iterdir())
