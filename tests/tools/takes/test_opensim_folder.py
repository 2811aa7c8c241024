"""OpenSim folder: OpenSim scales the model and finds the motion."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import zenocap
from tests.support.export_takes import LOST, TRACKED
from tests.support.opensim_models import write_model
from tests.support.places import ROOT
from zenocap.common.errors import UserError
from zenocap.common.formats.opensim_model import read_model
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trc import read_trc
from zenocap.tools.takes import opensim_folder
from zenocap.tools.takes.export import ExportOptions, export

STEPS = re.search(r"```python\n(.*?)```", (ROOT / "docs/into-opensim.md").read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    return write_model(tmp_path / "small.osim")


def test_the_folder_has_what_its_files_name(tracked: Path, model: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    status, out, err = zenocap("export", tracked, "-o", folder, "--to", "opensim", "--model", model, "--smooth", 6)
    assert (status, "note: 1 frames without pose: left out" in err) == (0, True), err
    assert "m, opensim" in out
    motion, body = read_trc(folder / "motion.trc"), read_trc(folder / "body.trc")
    assert motion.frames.tolist() == [k for k in range(TRACKED) if k != LOST]
    names = {marker.get("name") for marker in ET.parse(folder / "markers.xml").iter("Marker")}
    tasks = {task.get("name") for task in ET.parse(folder / "ik.xml").iter("IKMarkerTask")}
    assert names == tasks == set(motion.names) == set(body.names)
    inputs = [
        ET.parse(folder / "scale.xml").findtext(f".//{tag}") for tag in ("model_file", "marker_set_file", "marker_file")
    ]
    assert all(name and (folder / name).is_file() for name in inputs)
    assert "Butterworth low-pass, -3 dB at 6 Hz" in (folder / "README.txt").read_text()
    assert "Body: measured in a T-pose." in (folder / "README.txt").read_text()


def test_opensim_scales_the_model_and_finds_the_motion(
    tracked: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opensim = pytest.importorskip("opensim", reason="opensim is not installed: pip install opensim")
    opensim.Logger.setLevelString("Error")
    opensim.Logger.removeFileSink()
    export(tracked, tmp_path / "out", ExportOptions("opensim", model=model))
    monkeypatch.chdir(tmp_path / "out")
    assert STEPS is not None
    exec(STEPS[1], {})  # the steps of the documentation, word by word
    body = read_trc(Path("body.trc"))
    at = dict(zip(body.names, body.points[0], strict=True))
    scaled = read_model(Path("scaled.osim"))
    for child, near, far in (("tibia_r", "RHJC", "RKJC"), ("talus_l", "LKJC", "LAJC"), ("ulna_r", "RGH", "REJC")):
        assert np.linalg.norm(scaled.parents[child][1]) == pytest.approx(np.linalg.norm(at[near] - at[far]), abs=1e-4)
    (errors,) = Path().glob("*_ik_marker_errors.sto")
    rows = np.array([line.split() for line in errors.read_text().split("marker_error_max\n")[1].splitlines()], dtype=float)
    assert len(rows) == TRACKED - 1
    assert rows[:, 2].mean() < 0.03  # RMS of the markers, m
    assert Path("ik.mot").read_text().count("\n") > TRACKED


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ((), "model not given: allowed: an .osim file with --to opensim"),
        (("--model", "missing.osim"), "missing.osim: cannot be read"),
        (("--model", "small.osim", "--units", "mm"), "units mm, axes y-up: allowed in opensim: units m"),
        (("--model", "small.osim", "--axes", "unity"), "axes unity"),
        (("--model", "small.osim", "--joints", "halpe"), "joints halpe: opensim has no points"),
        (("--model", "small.osim", "--smooth", "20"), "smooth = 20 Hz: allowed: 0.1 to 13.5"),
    ],
)
def test_wrong_options_are_one_line_and_leave_nothing(
    arguments: tuple[str, ...], problem: str, tracked: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, err = zenocap("export", tracked, "-o", "out", "--to", "opensim", *arguments)
    assert (status, err.count("\n")) == (1, 1)
    assert problem in err
    assert [path.name for path in tmp_path.iterdir()] == ["small.osim"]


def test_a_folder_with_files_is_kept(tracked: Path, model: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine").write_text("mine")
    with pytest.raises(UserError, match=r"out: exists: allowed: a new folder, or an empty one"):
        export(tracked, tmp_path / "out", ExportOptions("opensim", model=model))
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine"]


def test_a_body_without_feet_is_refused(two_view: Path, model: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"out: the take's body ten-parts has no pelvis and feet"):
        export(two_view, tmp_path / "out", ExportOptions("opensim", model=model))


def test_a_full_disk_leaves_nothing(tracked: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(opensim_folder, "write_trc", full)
    with pytest.raises(UserError, match=r"out: cannot be written: No space left on device"):
        export(tracked, tmp_path / "out", ExportOptions("opensim", model=model))
    assert [path.name for path in tmp_path.iterdir()] == ["small.osim"]


def test_points_are_the_joint_centres_of_the_pose(tracked: Path) -> None:
    track = read_poses(tracked).track()
    found, centres = opensim_folder.points(track), track.trajectories("isb")
    known = np.flatnonzero(track.known)
    np.testing.assert_allclose(found.points[:, :12], centres.points[known], atol=1e-12)
    right, left, top = (found.points[:, found.names.index(name)] for name in ("RHJC", "LHJC", "PelvisTop"))
    np.testing.assert_allclose(np.linalg.norm(top - (right + left) / 2, axis=1), np.linalg.norm(right - left, axis=1))
