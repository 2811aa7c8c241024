"""Exports agree with one another and with the take; files are written atomically."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import ezc3d
import msgspec
import numpy as np
import pytest

import zenocap as zenocap_api
from tests.common.formats.test_bvh_writer import read_by_bvhio, read_by_text
from tests.common.formats.test_smoothing import gentle
from tests.common.formats.test_tables import read_csv
from tests.common.formats.test_take_poses import messages_of_track, tracker_messages, write_take
from tests.support.command import refused, zenocap
from tests.support.export_takes import COUNT, FIRST, MISSING
from tests.support.places import CLIPS
from tests.support.pose_tracks import NAMES, moving
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS
from zenocap.common.formats.take_poses import TakePoses, read_poses
from zenocap.common.formats.trajectories import PER_METRE
from zenocap.common.formats.trc import read_trc
from zenocap.common.rig.rig import load_rig
from zenocap.tools.cli.export import beside
from zenocap.tools.takes.export import ExportOptions, export
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import track

CLIP = CLIPS / "walk2"
SOME: tuple[str, ...] = ("trc", "bvh", "c3d", "csv")
needs_usd = pytest.mark.skipif(find_spec("pxr") is None, reason="usd-core is not installed: the extra usd")
POINTS = "has no points: allowed in trc, c3d, csv, parquet, npz"


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


@pytest.mark.slow
def test_without_output_a_file_is_written_beside_the_take_and_named(two_view: Path, tmp_path: Path) -> None:
    take = tmp_path / "walk.mcap"
    take.write_bytes(two_view.read_bytes())
    for options, name in (([], "walk.bvh"), (["--to", "trc"], "walk.trc")):
        status, text, problems = zenocap("export", take, *options)
        assert status == 0, problems
        assert text.startswith(f"{tmp_path / name}: ")
        assert (tmp_path / name).exists()
    for options, problem in (([], "walk.bvh is there already"), (["--to", "bhv"], "--to 'bhv': allowed: ")):
        status, _, problems = zenocap("export", take, *options)
        assert (status, problem in " ".join(problems.replace("│", " ").split())) == (2, True)
    assert beside(take, "opensim") == tmp_path / "walk-opensim"


def test_a_file_that_was_made_meanwhile_is_not_replaced_where_none_was_named(
    two_view: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take, output = tmp_path / "walk.mcap", tmp_path / "walk.trc"
    take.write_bytes(two_view.read_bytes())

    def slow(path: Path, *, raw: bool) -> TakePoses:
        output.write_text("mine")
        return read_poses(path, raw=raw)

    monkeypatch.setattr("zenocap.tools.takes.export.read_poses", slow)
    text = refused("export", take, "--to", "trc")
    assert text == f"error: {output} is there since a moment ago: allowed: -o FILE, which may replace it\n"
    assert output.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["walk.mcap", "walk.trc"]


@pytest.mark.nightly
@pytest.mark.parametrize("to", SOME)
def test_every_format_has_the_same_joint_centres_at_the_same_frames(to: str, two_view: Path, tmp_path: Path) -> None:
    assert zenocap("export", two_view, "--to", to, "-o", tmp_path / "a.x")[0] == 0
    found = centres(tmp_path / "a.x", to)
    expected = read_poses(two_view).trajectories().points
    if to in ("bvh", "c3d"):
        assert len(found) == FIRST + COUNT
        found = found[FIRST:]
    if to == "bvh":
        found[list(MISSING)] = np.nan
    np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("to", SOME)
def test_frame_range_is_exported_at_another_rate(to: str, two_view: Path, tmp_path: Path) -> None:
    arguments = ("--from", "0.5s", "--until", "30", "--fps", "20", "--axes", "z-up", "-o", tmp_path / "a.x")
    status, out, _ = zenocap("export", two_view, "--to", to, *arguments)
    assert status == 0
    assert f"11 frames, 10 to 20, 20/s, {FORMATS.row(to).unit}, z-up" in out  # 0.5 s to 1.0 s
    assert len(centres(tmp_path / "a.x", to)) == 11


@pytest.mark.slow
def test_exported_frame_range_keeps_its_frame_numbers(two_view: Path, tmp_path: Path) -> None:
    export(two_view, tmp_path / "a.trc", ExportOptions("trc"))
    for to in ("bvh", "c3d"):
        status, out, _ = zenocap("export", two_view, "--to", to, "-o", tmp_path / "a.x", "--from", "20", "--until", "25")
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
def test_frames_without_a_pose_are_reported(two_view: Path, tmp_path: Path) -> None:
    for name, words in (("a.csv", "3 frames without pose: blank"), ("a.bvh", "7 frames without pose: last pose repeated")):
        assert words in zenocap("export", two_view, "-o", tmp_path / name)[2]


@pytest.mark.parametrize("to", SOME)
def test_two_exports_give_equal_bytes(to: str, two_view: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        export(two_view, tmp_path / name / f"x.{to}", ExportOptions(to, fps=50))
    assert (tmp_path / "a" / f"x.{to}").read_bytes() == (tmp_path / "b" / f"x.{to}").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "status", "error"),
    [
        ("-o a.csv --from -1", 2, "--from"),
        ("-o a.csv --from 2m", 2, "--from"),
        ("-o a.csv --until 1e3", 2, "--until"),
        ("-o a.csv --fps 0", 2, "--fps"),
        ("-o a.csv --axes up", 2, "--axes"),
        ("-o a.csv --joints body25", 2, "--joints"),
        ("-o a.csv --min-confidence 1.5", 2, "--min-confidence"),
        ("-o a.trc --smooth six", 2, "allowed: a frequency in Hz, such as 6, or off"),
        ("-o a.trc --smooth 0", 1, "smooth = 0 Hz: allowed: 0.1 to 13.5, 0.45 of the 30 frames/s"),
        ("-o a.trc --smooth 20", 1, "smooth = 20 Hz: allowed: 0.1 to 13.5"),
        ("-o a.trc --smooth nan", 1, "smooth = nan Hz: allowed: "),
        ("-o a.csv --from 100", 1, "frames 4 to 43"),
        ("-o a.glb --from 11 --until 12", 1, "the person is lost in every frame: no pose to hold"),
        ("-o a.glb --units cm", 1, "a.glb: units cm, axes y-up: allowed in glb: units m, axes y-up"),
        ("-o a.glb --axes unity", 1, "a.glb: units m, axes unity: allowed in glb: units m, axes y-up"),
        ("-o a.mot --axes z-up", 1, "axes z-up: allowed in mot: units m, axes y-up, opensim"),
        ("-o a.mot --units mm", 1, "units mm, axes y-up: allowed in mot: units m, axes y-up, opensim"),
        ("-o a.bvh --bones vrm", 1, "a.bvh: bones vrm: allowed in glb, usd"),
        ("-o a.x --to usd", 1, "a.x: suffix '.x': allowed in usd: .usd, .usda, .usdc, .usdz"),
        ("-o a.bvh --joints halpe", 1, f"a.bvh: joints halpe: bvh {POINTS}"),
        ("-o a.mot --joints halpe", 1, f"a.mot: joints halpe: mot {POINTS}"),
        ("-o a.glb --joints coco", 1, f"a.glb: joints coco: glb {POINTS}"),
        ("-o a.bvh --spine", 1, f"a.bvh: spine: bvh {POINTS}"),
        ("-o a.mot --spine", 1, f"a.mot: spine: mot {POINTS}"),
        ("-o a.glb --spine", 1, f"a.glb: spine: glb {POINTS}"),
        ("-o a.bvh --min-confidence 0.5", 1, "bvh has no points to leave out: allowed in trc, c3d, csv, parquet, npz"),
        ("-o a.trc --min-confidence 0.9", 1, "the take states none: allowed with takes of the tracker"),
        ("-o /dev/null/a.csv", 1, "/dev/null/a.csv: cannot be written"),
        ("-o /proc/a.glb", 1, "/proc/a.glb: cannot be written"),
        pytest.param("-o /proc/a.usda", 1, "/proc/a.usda: cannot be written", marks=[pytest.mark.slow, needs_usd]),
        pytest.param("-o /proc/a.usdz", 1, "/proc/a.usdz: cannot be written", marks=[pytest.mark.slow, needs_usd]),
    ],
)
def test_what_cannot_be_exported_is_refused_in_one_line(
    arguments: str, status: int, error: str, two_view: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found, out, text = zenocap("export", two_view, *arguments.split())
    assert (found, out) == (status, "")
    assert error in text
    assert status == 2 or text.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("a.mot", "a.mot: the person is lost in every frame: no row to write"),
        ("a.glb", "lost in every frame: no pose to hold"),
    ],
)
def test_a_take_without_poses_is_refused(name: str, error: str, tmp_path: Path) -> None:
    empty = write_take(tmp_path / "empty.mcap", messages_of_track(moving(3, lost=(0, 1, 2))))
    status, _, text = zenocap("export", empty, "-o", tmp_path / name)
    assert (status, text.count("\n"), error in text) == (1, 1, True)
    assert not (tmp_path / name).exists()


def test_intact_part_of_a_truncated_take_is_exported(two_view: Path, tmp_path: Path) -> None:
    data = two_view.read_bytes()
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
def test_full_disk_keeps_the_previous_file_and_leaves_no_partial_one(to: str, two_view: Path, tmp_path: Path) -> None:
    output = tmp_path / f"a.{to}"
    output.write_text("before")
    with files_no_longer_than(4096), pytest.raises(UserError, match=rf"a\.{to}: cannot be written"):
        export(two_view, output, ExportOptions(to))
    assert [path.name for path in tmp_path.iterdir()] == [output.name]
    assert output.read_text() == "before"


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
def test_files_say_how_they_were_smoothed(to: str, two_view: Path, tmp_path: Path) -> None:
    if to == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed: the extra tables")
    path = tmp_path / f"a.{to}"
    status, _, err = zenocap("export", two_view, "-o", path, "--smooth", 6)
    assert status == 0
    assert "too short to smooth, unchanged: stretches " in err  # random poses jump: every stretch is short
    text = "Butterworth low-pass, -3 dB at 6 Hz, order 4, forwards and backwards"
    if to == "npz":
        assert text in str(np.load(path)["metadata"])
    elif to == "c3d":
        assert ezc3d.c3d(str(path))["parameters"]["ZENOCAP"]["SMOOTHING"]["value"][0].startswith(text)
    else:
        assert text.encode() in path.read_bytes()


@pytest.mark.parametrize(("to", "fps", "said"), [("bvh", (), True), ("trc", (), False), ("bvh", ("--fps", 30), False)])
def test_uneven_times_in_a_format_with_one_rate_are_said(to: str, fps: tuple[str, ...], said: bool, tmp_path: Path) -> None:
    track = moving(60)
    slower = replace(track, times_s=np.where(track.frames < 30, track.times_s, 2 * track.times_s - track.times_s[30]))
    take = write_take(tmp_path / "phone.mcap", messages_of_track(slower))
    status, _, err = zenocap("export", take, "-o", tmp_path / f"phone.{to}", *fps)
    assert status == 0
    assert ("the times are uneven" in err) == (f"{to} has one rate: rows are up to 0.49 s" in err) == said, err


@pytest.mark.parametrize("to", ["trc", "csv", "npz", "parquet"])
def test_frames_that_a_live_take_leaves_out_are_rows_without_pose(to: str, tmp_path: Path) -> None:
    """So that a reader who counts rows by DataRate is right about time."""
    track = moving(30, first=4)
    kept = np.array([k for k in range(30) if k % 3 or k == 0])  # 20 of 29 frames, up to the last one
    take = write_take(tmp_path / "live.mcap", messages_of_track(track.rows(kept)))
    found = export(take, tmp_path / f"live.{to}", ExportOptions(to))
    assert (found.rows, found.first, found.last, found.empty) == (30, 4, 33, 9)
    if to == "trc":
        again = read_trc(tmp_path / "live.trc")
        assert again.rate == pytest.approx(30.0, rel=1e-3)
        np.testing.assert_allclose(np.diff(again.times_s), 1 / 30, atol=1e-3)


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize("to", ["trc", "npz", "c3d"])
def test_a_body_that_was_not_measured_is_said(to: str, measured: bool, tmp_path: Path) -> None:
    messages = [
        msgspec.structs.replace(one, measured=measured) if isinstance(one, m.TrackerBdp) else one
        for one in tracker_messages(moving(20))
    ]
    path = tmp_path / f"a.{to}"
    status, _, err = zenocap("export", write_take(tmp_path / "a.mcap", messages), "-o", path)
    assert status == 0
    assert ("note: the body has average proportions, not measured in a T-pose" in err) == (not measured)
    if to == "npz":
        assert ("body_sizes" in str(np.load(path)["metadata"])) == (not measured)
    if to == "c3d":
        assert ("BODY" in ezc3d.c3d(str(path))["parameters"].get("ZENOCAP", {})) == (not measured)
