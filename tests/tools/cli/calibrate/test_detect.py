"""`calibrate detect`: the calibration of the videos, bit for bit; wrong calls."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.board_films import board_videos
from tests.support.board_views import places, rig_error_m
from tests.support.stored import stored_files
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.tools.cli.calibrate.commands import calibrate
from zenocap.tools.setup.calibration.board_films import board_films

BOARD = ("--square", "200")


def run(command: str, *arguments: object):
    return CliRunner().invoke(calibrate, [command, *(str(a) for a in arguments)])


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
        result = run("detect", folder, *BOARD)
        assert result.exit_code == 0, result.output
        assert f"{name}: " in result.output
        assert " of 70 images show the board, in " in result.output
        assert f"written: {folder / 'corners' / f'{name}.corners'}, 0.0 MB" in result.output
        folders.append(folder)
    return folders


@pytest.mark.nightly
def test_the_calibration_is_that_from_the_videos_bit_for_bit(films, machines, tmp_path):
    options = ("--lenses", films / "lenses.toml", "--floor", "6", "--json")
    result = run("board", films, *BOARD, *options, "-o", tmp_path / "videos.toml")
    assert result.exit_code in (0, 3), result.output
    of_videos = json.loads(result.output[result.output.index("{") :])
    assert rig_error_m(list(read_calibration(tmp_path / "videos.toml").values()), truth(films), places()) < 0.01
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
        output = folder / "calibration.toml"
        result = run("board", folder, *BOARD, *options, "-o", output)
        found = json.loads(result.output[result.output.index("{") :])
        assert found | {"written": ""} == of_videos | {"written": ""}
        assert output.read_bytes() == (tmp_path / "videos.toml").read_bytes()


def truth(films: Path):
    return list(read_calibration(films / "truth.toml").values())


@pytest.mark.slow
def test_corner_files_hold_no_picture(films, machines):
    for folder in machines:
        (path,) = (folder / "corners").iterdir()
        assert path.stat().st_size < 50_000
        assert path.stat().st_size < (films / "videos" / f"{path.stem}.mp4").stat().st_size / 10


@pytest.mark.slow
def test_another_board_is_refused(machines, tmp_path):
    files = [folder / "corners" / f"{name}.corners" for folder, name in zip(machines, ("cam01", "cam02"), strict=True)]
    result = run("board", *files, "--square", "198", "-o", tmp_path / "a.toml")
    assert result.exit_code == 1
    assert "cam01.corners: board.square_m = 0.2: allowed: 0.198, as in the options" in result.output
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.slow
def test_existing_corners_are_kept_without_force_and_json_names_them(machines, tmp_path):
    folder = machines[0]
    result = run("detect", folder, *BOARD)
    assert (result.exit_code, "exists already: allowed: another name, or --force" in result.output) == (1, True)
    result = run("detect", folder, *BOARD, "--json", "-o", tmp_path / "there")
    data = json.loads(result.output[result.output.index("{") :])
    (camera,) = data["cameras"]
    assert camera["name"] == "cam01"
    assert camera["images"] == 70
    assert camera["views"] > 30
    assert camera["written"] == str(tmp_path / "there" / "cam01.corners")
    assert board_films([tmp_path / "there"])[0][0].name == "cam01"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [(("--square", "0.1"), 1, "--square 0.1: allowed: the side of a square, 2 to 1000 mm"), ((), 2, "--square")],
)
def test_wrong_options_are_refused(films, tmp_path, arguments, status, text):
    result = run("detect", films, *arguments, "-o", tmp_path)
    assert (result.exit_code, text in result.output) == (status, True), result.output
    assert not list(tmp_path.iterdir())
