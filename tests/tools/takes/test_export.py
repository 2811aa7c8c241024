"""Exports agree with one another and with the take; files are written atomically."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import ezc3d
import numpy as np
import pytest

import zenocap as zenocap_api
from tests.common.formats.test_bvh_writer import read_by_bvhio, read_by_text
from tests.common.formats.test_smoothing import gentle
from tests.common.formats.test_tables import read_csv
from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.command import zenocap
from tests.support.places import CLIPS
from tests.support.pose_tracks import NAMES, moving
from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import PER_METRE
from zenocap.common.formats.trc import read_trc
from zenocap.common.rig.rig import load_rig
from zenocap.tools.takes.export import ExportOptions, export
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import track

CLIP = CLIPS / "walk2"
SOME: tuple[str, ...] = ("trc", "bvh", "c3d", "csv")
LOST, FIRST, COUNT = (7, 8, 9), 4, 40


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    messages = messages_of_track(moving(COUNT, first=FIRST, lost=LOST, rate=30.0))
    return write_take(tmp_path_factory.mktemp("takes") / "take.mcap", messages)


def centres(path: Path, to: str) -> Floats:
    """(n, markers, 3) metres as in the file, NaN where blank."""
    match to:
        case "trc":
            return read_trc(path).points
        case "bvh":
            return read_by_text(path) / PER_METRE[FORMATS.row(to).unit]
        case "c3d":
            points = ezc3d.c3d(str(path))["data"]["points"]
            return np.asarray(points[:3].transpose(2, 1, 0) / PER_METRE[FORMATS.row(to).unit])
        case "csv":
            rows = read_csv(path)
            return np.array([[[float(row[f"{name}.{a}_m"] or "nan") for a in "xyz"] for name in NAMES] for row in rows])


@pytest.mark.nightly
@pytest.mark.parametrize("to", SOME)
def test_every_format_has_the_same_joint_centres_at_the_same_frames(to: str, take: Path, tmp_path: Path) -> None:
    assert zenocap("export", take, "--to", to, "-o", tmp_path / "a.x")[0] == 0
    found = centres(tmp_path / "a.x", to)
    expected = read_poses(take).trajectories().points
    if to in ("bvh", "c3d"):
        assert len(found) == FIRST + COUNT
        found = found[FIRST:]
    if to == "bvh":
        found[list(LOST)] = np.nan
    np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("to", SOME)
def test_frame_range_is_exported_at_another_rate(to: str, take: Path, tmp_path: Path) -> None:
    arguments = ("--from", "0.5s", "--until", "30", "--fps", "20", "--axes", "z-up", "-o", tmp_path / "a.x")
    status, out, _ = zenocap("export", take, "--to", to, *arguments)
    assert status == 0
    assert f"11 frames, 10 to 20, 20/s, {FORMATS.row(to).unit}, z-up" in out  # 0.5 s to 1.0 s
    assert len(centres(tmp_path / "a.x", to)) == 11


@pytest.mark.slow
def test_exported_frame_range_keeps_its_frame_numbers(take: Path, tmp_path: Path) -> None:
    export(take, tmp_path / "a.trc", ExportOptions("trc"))
    for to in ("bvh", "c3d"):
        status, out, _ = zenocap("export", take, "--to", to, "-o", tmp_path / "a.x", "--from", "20", "--until", "25")
        assert (status, "6 frames, 20 to 25" in out) == (0, True)
        np.testing.assert_allclose(centres(tmp_path / "a.x", to), read_trc(tmp_path / "a.trc").points[16:22], atol=1e-5)


@pytest.mark.nightly
@pytest.mark.parametrize("to", SOME)
def test_smoothing_is_off_unless_asked_for(to: str, tmp_path: Path) -> None:
    path = write_take(tmp_path / "noisy.mcap", messages_of_track(gentle(60)))
    files = [tmp_path / f"{name}.{to}" for name in ("raw", "off", "smooth")]
    for output, options in zip(files, ([], ["--smooth", "off"], ["--smooth", "6"]), strict=True):
        assert zenocap("export", path, "-o", output, *options)[0] == 0
    raw, off, smooth = (centres(file, to) for file in files)
    np.testing.assert_array_equal(raw, off)
    assert np.nanstd(np.diff(smooth, 2, axis=0)) < 0.5 * np.nanstd(np.diff(raw, 2, axis=0))
    if to == "trc":
        opened = zenocap_api.open_take(path)
        np.testing.assert_allclose(opened.poses(smooth=6.0).joint_centres, smooth, atol=1e-6)
        np.testing.assert_allclose(opened.poses().joint_centres, raw, atol=1e-6)
        opened.export(tmp_path / "api.trc", smooth=6.0)
        assert (tmp_path / "api.trc").read_text().replace("api", "smooth") == files[2].read_text()


@pytest.mark.slow
def test_smoothing_comes_before_the_selection_of_frames(tmp_path: Path) -> None:
    path = write_take(tmp_path / "noisy.mcap", messages_of_track(gentle(60)))
    zenocap("export", path, "-o", tmp_path / "a.trc", "--smooth", "4")
    zenocap("export", path, "-o", tmp_path / "b.trc", "--smooth", "4", "--from", "20", "--until", "22")
    np.testing.assert_array_equal(centres(tmp_path / "a.trc", "trc")[20:23], centres(tmp_path / "b.trc", "trc"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "status", "error"),
    [
        ("six", 2, "allowed: a frequency in Hz, such as 6, or off"),
        ("0", 1, "smooth = 0 Hz: allowed: 0.1 to 13.5, 0.45 of the 30 frames/s"),
        ("20", 1, "smooth = 20 Hz: allowed: 0.1 to 13.5"),
        ("nan", 1, "smooth = nan Hz: allowed: "),
    ],
)
def test_a_wrong_frequency_is_one_line(value: str, status: int, error: str, take: Path, tmp_path: Path) -> None:
    found, _, text = zenocap("export", take, "-o", tmp_path / "a.trc", "--smooth", value)
    assert found == status
    assert error in text
    assert not (tmp_path / "a.trc").exists()


@pytest.mark.slow
def test_frames_without_a_pose_are_reported(take: Path, tmp_path: Path) -> None:
    assert "3 frames without pose: blank" in zenocap("export", take, "--to", "csv", "-o", tmp_path / "a.csv")[2]
    assert (
        "7 frames without pose: last pose repeated" in zenocap("export", take, "--to", "bvh", "-o", tmp_path / "a.bvh")[2]
    )


@pytest.mark.parametrize("to", SOME)
def test_two_exports_give_equal_bytes(to: str, take: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        export(take, tmp_path / name / f"x.{to}", ExportOptions(to, fps=50))
    assert (tmp_path / "a" / f"x.{to}").read_bytes() == (tmp_path / "b" / f"x.{to}").read_bytes()


@pytest.mark.parametrize(
    "arguments",
    [
        ("--from", "-1"), ("--from", "2m"), ("--until", "1e3"), ("--fps", "0"), ("--axes", "up"), ("--joints", "body25"),
        ("--min-confidence", "1.5"),
    ],
)  # fmt: skip
def test_wrong_usage_is_status_2(arguments: tuple[str, str], take: Path, tmp_path: Path) -> None:
    status, _, err = zenocap("export", take, "--to", "csv", "-o", tmp_path / "a.csv", *arguments)
    assert status == 2
    assert arguments[0] in err
    assert list(tmp_path.iterdir()) == []


def test_empty_frame_range_is_a_one_line_error(take: Path, tmp_path: Path) -> None:
    status, _, err = zenocap("export", take, "--to", "csv", "-o", tmp_path / "a.csv", "--from", "100")
    assert (status, err.count("\n")) == (1, 1)
    assert "frames 4 to 43" in err


def test_intact_part_of_a_truncated_take_is_exported(take: Path, tmp_path: Path) -> None:
    data = take.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: int(0.75 * len(data))])
    status, out, err = zenocap("export", tmp_path / "cut.mcap", "--to", "bvh", "-o", tmp_path / "a.bvh")
    assert status == 3
    assert "frames" in out
    assert "lost: " in err


@contextmanager
def files_no_longer_than(limit: int) -> Iterator[None]:
    """Limit on file sizes by the operating system, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("to", SOME)
def test_full_disk_keeps_the_previous_file_and_leaves_no_partial_one(to: str, take: Path, tmp_path: Path) -> None:
    output = tmp_path / f"a.{to}"
    output.write_text("before")
    with files_no_longer_than(4096), pytest.raises(UserError, match=rf"a\.{to}: cannot be written"):
        export(take, output, ExportOptions(to))
    assert [path.name for path in tmp_path.iterdir()] == [output.name]
    assert output.read_text() == "before"


def test_output_folder_that_cannot_be_created_is_an_error(take: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        export(take, tmp_path / "file" / "a.csv", ExportOptions("csv"))


def test_interrupted_writer_leaves_no_file(tmp_path: Path) -> None:
    def interrupted() -> None:
        with atomic_file(tmp_path / "a.txt") as unfinished:
            unfinished.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nightly
@pytest.mark.clips
@pytest.mark.skipif(not CLIP.exists(), reason="the shared test clips are not beside the project")
@pytest.mark.parametrize(("method", "read_bvh"), [("two-view", read_by_bvhio), ("hybrid", read_by_text)])
def test_tracked_take_round_trips_through_bvh(method: str, read_bvh: Callable[[Path], Floats], tmp_path: Path) -> None:
    """The `bvhio` package turns bones that are not along Y, such as the head of the fourteen parts."""
    track(at_working_size(load_rig(CLIP, method, files=True), (160, 120), None), tmp_path / "a.mcap")
    for fps in (None, 24.0, 120.0):
        export(tmp_path / "a.mcap", tmp_path / "a.bvh", ExportOptions("bvh", fps=fps))
        export(tmp_path / "a.mcap", tmp_path / "a.trc", ExportOptions("trc", fps=fps))
        expected = read_trc(tmp_path / "a.trc")
        known = ~np.isnan(expected.points).any(axis=(1, 2))
        found = read_bvh(tmp_path / "a.bvh")[expected.frames[known]] / PER_METRE["cm"]
        assert np.linalg.norm(found - expected.points[known], axis=2).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("to", ["parquet", "npz", "mot", "c3d"])
def test_files_say_how_they_were_smoothed(to: str, take: Path, tmp_path: Path) -> None:
    if to == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed: pip install 'zenocap[tables]'")
    path = tmp_path / f"a.{to}"
    status, _, err = zenocap("export", take, "-o", path, "--smooth", 6)
    assert status == 0
    assert "too short to smooth, unchanged: stretches " in err  # random poses jump: every stretch is short
    text = "Butterworth low-pass, -3 dB at 6 Hz, order 4, forwards and backwards"
    if to == "npz":
        assert text in str(np.load(path)["metadata"])
    elif to == "c3d":
        assert ezc3d.c3d(str(path))["parameters"]["ZENOCAP"]["SMOOTHING"]["value"][0].startswith(text)
    else:
        assert text.encode() in path.read_bytes()
