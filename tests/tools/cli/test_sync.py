"""`zenocap sync` on folders and rig files: what it prints and writes, and its exit status."""

import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import printed, refused
from tests.support.moving_balls import FPS, ring, write_folder
from tests.support.video_file import Sound
from zenocap.common.rig.rig import demo_rig_file, load_rig
from zenocap.tools.cli.sync import camera_names

pytestmark = pytest.mark.slow
CAMERAS = ring((0, 90))
STARTS = {"cam01": 1.0, "cam02": 1.7}
RATE = 16_000
EXACT_S = 0.15 / FPS  # from silhouettes of 5 s
SOURCE = np.random.default_rng(0).standard_normal(RATE * 12) * 0.1
sync = partial(printed, "sync")


def sounds(starts_s: dict[str, float]) -> dict[str, Sound]:
    return {name: Sound(SOURCE[round(start * RATE) :][: 5 * RATE], RATE) for name, start in starts_s.items()}


def offsets(folder: Path) -> dict[str, float]:
    return tomllib.loads((folder / "sync.toml").read_text())["offset_s"]


def test_silhouettes_without_sound_write_sync_toml_that_load_rig_reads(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS)
    (folder / "sync.toml").write_text("[offset_s]\ncam01 = 0.0\ncam02 = 0.2\n")  # an existing file does not matter
    assert "no video has sound" in sync(folder)
    assert offsets(folder)["cam01"] == 0
    assert abs(offsets(folder)["cam02"] - 0.7) < EXACT_S
    assert "from silhouettes" in (folder / "sync.toml").read_text().splitlines()[0]
    assert any("sync.toml" in note for note in load_rig(folder).notes)


@pytest.mark.nightly
def test_sound_is_preferred_and_a_dry_run_writes_nothing(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS, sounds(STARTS))
    output = sync(folder, "--dry-run")
    assert "cam02: +0.7000 s, +21.00 frames" in output
    assert "by sound" in output
    assert not (folder / "sync.toml").exists()
    assert "by silhouettes" in sync(folder, "--by", "silhouettes", "--dry-run")


@pytest.mark.nightly
def test_a_camera_without_sound_is_found_from_silhouettes(tmp_path: Path) -> None:
    cameras, starts = ring((0, 90, 45)), STARTS | {"cam03": 1.3}
    folder = write_folder(tmp_path / "one", cameras, starts, sounds(STARTS))
    assert "cam03: no sound" in sync(folder)
    assert abs(offsets(folder)["cam02"] - 0.7) < 0.002
    assert abs(offsets(folder)["cam03"] - 0.3) < EXACT_S
    assert "from sound and silhouettes" in (folder / "sync.toml").read_text()
    assert "cam03: not certain, by sound: no sound" in sync(folder, "--by", "sound", status=3)


@pytest.mark.nightly
@pytest.mark.parametrize("offset_s", [-2.0, -0.513, 0.7, 2.0])
def test_a_flash_is_found_where_the_person_stands_still(tmp_path: Path, offset_s: float) -> None:
    starts = {"cam01": 2.0, "cam02": 2.0 + offset_s}
    on_s = max(starts.values()) + 1.513
    folder = write_folder(tmp_path / "one", CAMERAS, starts, still=True, flash_s=(on_s, on_s + 1 / FPS))
    assert "by flash" in sync(folder)
    assert abs(offsets(folder)["cam02"] - offset_s) < 0.1 / FPS
    assert "from flash" in (folder / "sync.toml").read_text().splitlines()[0]


@pytest.mark.nightly
def test_a_flash_within_one_exposure_is_coarser_than_silhouettes(tmp_path: Path) -> None:
    on_s = 1.7 + 1.0 + 0.5 / FPS  # in the middle of an exposure of both
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS, flash_s=(on_s, on_s + 0.4 / FPS))
    assert "by silhouettes" in sync(folder, "--dry-run")
    assert "cam02: +0.7000 s, +21.00 frames (± 0.41), by flash" in sync(folder, "--by", "flash", "--dry-run")


@pytest.mark.nightly
def test_some_cameras_are_compared_and_the_offsets_of_the_others_stay(tmp_path: Path) -> None:
    cameras, starts = ring((0, 90, 45)), STARTS | {"cam03": 1.3}
    folder = write_folder(tmp_path / "one", cameras, starts, sounds(starts))
    (folder / "sync.toml").write_text("[offset_s]\ncam01 = 9.0\ncam02 = 0.5\ncam03 = 0.0\n")
    output = sync(folder, "--cameras", "cam02,cam03")
    assert "cam01" not in output
    assert offsets(folder) == pytest.approx({"cam01": 9.0, "cam02": 0.5, "cam03": 0.1}, abs=0.002)
    assert "'cam09': no such camera" in refused("sync", folder, "--cameras", "cam02,cam09")


@pytest.mark.nightly
def test_rig_file_gets_lines_to_copy(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS, sounds(STARTS))
    viewers = "".join(f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "videos/cam0{k}.mp4"\n' for k in (1, 2))
    rig = folder / "rig.toml"
    rig.write_text(f'name = "one"\ncalibration = "calibration.toml"\n{viewers}')
    assert "offset_s = 0.7000  # viewer 2" in sync(rig)
    assert not (folder / "sync.toml").exists()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("starts", "scene", "options", "reason"),
    [
        ({"cam01": 0.0, "cam02": 1.7}, {}, (), "larger than --max-offset"),
        (STARTS, {"still": True}, (), "the videos have too little in common"),
        (STARTS, {"without_person": ("cam02",)}, (), "cam02: not certain, by silhouettes: no person in view"),
        (STARTS, {}, ("--by", "flash"), "cam02: not certain, by flash: no flash"),
    ],
)
def test_what_is_not_certain_is_not_written(
    tmp_path: Path, starts: dict[str, float], scene: dict[str, object], options: tuple[str, ...], reason: str
) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, starts, **scene)
    output = sync(folder, "--max-offset", 1, *options, status=3)
    assert reason in output
    assert "a clap" in output
    assert not (folder / "sync.toml").exists()


@pytest.mark.nightly
def test_videos_that_began_together_have_the_offset_0(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, {"cam01": 1.0, "cam02": 1.0})
    assert "began together" in sync(folder)
    assert offsets(folder) == {"cam01": 0, "cam02": 0}


def test_wrong_input_is_an_error_of_one_line(tmp_path: Path) -> None:
    sync(tmp_path, status=1)
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS, seconds=0.2)
    (folder / "videos" / "cam02.mp4").write_bytes(b"no video")
    refused("sync", folder)
    assert "allowed for sync: video files" in sync(demo_rig_file(), status=1)


def test_names_of_cameras_with_spaces_are_kept(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "one", CAMERAS, STARTS, seconds=0.2)
    text = (folder / "calibration.toml").read_text()
    (folder / "calibration.toml").write_text(text.replace('"cam01"', '"cam 1"'))
    assert camera_names(folder) == {"cam-1": "cam 1", "cam02": "cam02"}
