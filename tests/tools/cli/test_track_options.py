"""The options of `zenocap track`, and the rig that they give."""

from pathlib import Path

import pytest

from tests.support.documentation import parse
from tests.support.package_rows import add_row
from tests.support.places import ROOT
from tests.support.video_file import write_video
from tests.support.videos import grey_frames
from zenocap.common.errors import UserError
from zenocap.common.rig.methods import AUTO, METHODS, TWO_VIEW
from zenocap.common.rig.sources import Background, FirstFrames, MedianFrames
from zenocap.tools.cli.track_options import TrackArguments, TrackExpert, TrackResearch, configured_rig


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of two videos of 30/s."""
    for name in ("cam01", "cam02"):
        write_video(tmp_path / "walk" / "videos" / f"{name}.mp4", grey_frames(2, (640, 480)), fps=30)
    calibration = ROOT / "zenocap" / "data" / "rigs" / "demo-calibration.toml"
    (tmp_path / "walk" / "calibration.toml").write_text(calibration.read_text())
    return tmp_path / "walk"


def backgrounds(source: Path, **given: object) -> list[Background]:
    rig = configured_rig([source], TrackArguments(**given), TrackExpert(), TrackResearch())  # type: ignore[arg-type]  # options by name
    return [viewer.background for viewer in rig.viewers]


def test_the_empty_scene_of_a_folder_can_be_given(folder: Path) -> None:
    assert backgrounds(folder) == [MedianFrames()] * 2
    assert backgrounds(folder, empty_frames=20) == [FirstFrames(20)] * 2
    assert backgrounds(folder, empty_seconds=1.5) == [FirstFrames(45)] * 2
    (folder / "clip.toml").write_text("empty_seconds = 1.0\n")
    assert backgrounds(folder) == [FirstFrames(30)] * 2
    assert backgrounds(folder, empty_seconds=0.5) == [FirstFrames(15)] * 2
    given = {"calibration": folder / "calibration.toml", "empty_seconds": 0.5}
    assert backgrounds(folder / "videos", **given) == [FirstFrames(15)] * 2


def test_frames_and_seconds_of_the_empty_scene_contradict_each_other(folder: Path) -> None:
    with pytest.raises(UserError, match=r"empty_frames = 3 and empty_seconds = 1: allowed: one of them"):
        backgrounds(folder, empty_frames=3, empty_seconds=1.0)


@pytest.mark.parametrize("line", ["track walk -o walk.mcap", "posture train examples.csv -o mine.postures"])
def test_a_method_of_a_package_is_chosen_and_named_beside_the_own_ones(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    add_row(monkeypatch, METHODS, "upright", TWO_VIEW)
    for method in (AUTO, *METHODS.names()):
        parse(f"zenocap {line} --method {method}")
    with pytest.raises(Exception, match=r"'joint': allowed: auto, two-view, .*, both, upright$") as error:
        parse(f"zenocap {line} --method joint")
    assert error.value.exit_code == 2
