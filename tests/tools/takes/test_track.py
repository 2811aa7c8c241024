"""Offline tracking by the steps of the live system: every frame, fixed order, reproducible bytes."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from zenocap.common import messages as m
from zenocap.common.errors import SourceError, UserError
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.tables import write_csv
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import Rig, demo_rig, demo_rig_file, load_rig
from zenocap.common.rig.sources import Actor, AdaptiveBackground, Device, FirstFrames
from zenocap.common.topics import HANDLED, SILHOUETTE
from zenocap.tools.operate.warmup import parts as warmup
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.overlay import Overlay
from zenocap.tools.takes.render.floor import darken_floor, draw_floor
from zenocap.tools.takes.render.rasterizer import develop, fill, light_body
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import Tracked, TrackedFrameSet, track
from zenocap.tools.takes.verify.recompute import verify

pytestmark = pytest.mark.slow


def with_viewers(rig: Rig, **changes: object) -> Rig:
    return replace(rig, viewers=tuple(replace(viewer, **changes) for viewer in rig.viewers))


@pytest.fixture(scope="module")
def short_rig() -> Rig:
    """The demo rig with a simulated person who raises both arms once."""
    return with_viewers(demo_rig("two-view"), source=Actor("raise-both-arms", 3))


@pytest.fixture(scope="module")
def take(short_rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("take") / "one.mcap"
    track(short_rig, path)
    return path


def test_two_runs_give_equal_bytes(short_rig: Rig, take: Path, tmp_path: Path) -> None:
    result = track(short_rig, tmp_path / "two.mcap")
    assert (tmp_path / "two.mcap").read_bytes() == take.read_bytes()
    assert result.poses > 20
    assert result.problems == ()


@pytest.mark.nightly
def test_both_methods_run_on_the_same_silhouettes(tmp_path: Path) -> None:
    """The exchange is that of two-view alone, and the tracker gets the silhouettes that it gets alone; readers of the take
    use its poses."""
    found: dict[str, dict[type[m.Message], list[m.Message]]] = {}
    for method in ("both", "two-view", "hybrid"):
        rig = replace(
            with_viewers(load_rig(demo_rig_file("both"), method), source=Actor("raise-both-arms", 3)), recognizer=None
        )
        small = at_working_size(with_viewers(rig, preview=False), (160, 120), None)
        path = tmp_path / f"{method}.mcap"
        result = track(small, path)
        messages = [received.message for received in TakeReader(path).envelopes(invalid="raise")]
        kinds = (m.PartialBdp, m.PartialBap, m.Assignment, m.UniversalBap, m.TrackerPose, m.Silhouette)
        found[method] = {kind: [one for one in messages if type(one) is kind] for kind in kinds}
        assert result.poses == len(found[method][m.UniversalBap if method == "two-view" else m.TrackerPose]) > 20
    for kind in (m.PartialBdp, m.PartialBap, m.Assignment, m.UniversalBap):
        assert found["both"][kind] == found["two-view"][kind] != []
    assert len(found["both"][m.TrackerPose]) == len(found["hybrid"][m.TrackerPose])
    seen, alone = ({(one.viewer, one.frame): one for one in found[name][m.Silhouette]} for name in ("both", "hybrid"))
    assert seen == {key: alone[key] for key in seen}  # viewers of the tracker alone also send empty ones at the beginning
    assert len(read_poses(tmp_path / "both.mcap").baps) == len(found["both"][m.TrackerPose])
    assert verify([tmp_path / "both.mcap"]).failed is False


def test_a_take_has_every_frame_of_every_viewer(take: Path) -> None:
    messages = [received.message for received in TakeReader(take).envelopes(invalid="raise")]
    start = next(message.frame for message in messages if isinstance(message, m.Sighting))
    for viewer in ("1", "2"):
        numbers = [message.frame for message in messages if isinstance(message, m.Sighting) and message.viewer == viewer]
        assert numbers == list(range(start, start + len(numbers)))
    assert isinstance(messages[0], m.CameraInfo)
    assert messages[0].captured_ns == EPOCH_NS == min(message.captured_ns for message in messages)


def test_take_contains_rig_file_calibration_and_versions(take: Path) -> None:
    read = TakeReader(take)
    assert sum(1 for _ in read.messages()) > 100
    assert set(read.attachments) == {
        "demo-two-view.toml", "demo-calibration.toml", "parameters.json", "setup.json", "recognizer.postures",
    }  # fmt: skip
    assert read.metadata["rig"]["name"] == "demo"
    assert "numpy" in read.metadata["versions"]


def test_poses_of_a_take_have_plausible_heights_and_times(take: Path) -> None:
    poses = read_poses(take)
    data = poses.trajectories()
    assert poses.rate() == pytest.approx(15, rel=0.02)
    np.testing.assert_allclose(data.times_s, data.frames / 15, atol=1e-6)
    head = data.points[:, data.names.index("Head"), 1]
    assert 1.3 < np.nanmedian(head) < 2.1


def test_a_csv_row_has_a_cell_for_every_heading(take: Path, tmp_path: Path) -> None:
    poses = read_poses(take)
    write_csv(tmp_path / "a.csv", ExportRequest(poses.track()))
    lines = (tmp_path / "a.csv").read_text().splitlines()
    heading = lines[0].split(",")
    assert len(lines) == 1 + len(poses.baps)
    assert {len(line.split(",")) for line in lines} == {len(heading)}
    turn = poses.anatomy.index["navel.y"]
    row = dict(zip(heading, lines[-1].split(","), strict=True))
    angle = poses.pose(poses.baps[-1]).angles[turn]
    assert float(row["navel.y_deg"]) == pytest.approx(np.degrees(angle), abs=1e-5)
    assert row["view.1"] in ("facade", "flank")


def test_a_take_without_poses_cannot_be_exported(short_rig: Rig, tmp_path: Path) -> None:
    unseen = with_viewers(short_rig, source=Actor("march", 1), fps=1.0, silhouette=False)  # of which no height is known
    assert track(unseen, tmp_path / "a.mcap").poses == 0
    with pytest.raises(UserError, match=r"a\.mcap: no universal BDP"):
        read_poses(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("second", "kept"),
    [({"poses": 50}, "b"), ({"poses": 29}, "a"), ({"poses": 50, "complete": False}, "a")],
    ids=["more poses", "fewer", "full disk"],
)
def test_the_second_time_with_an_estimated_height_replaces_no_better_take(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, second: dict[str, Any], kept: str
) -> None:
    first = Tracked(60, 30, 100, (), {}, measured=False, estimated=1.7, waited=20)
    results = iter([("a", first), ("b", replace(first, **second))])

    def tracked(rig: Rig, take: Path, *_: object) -> Tracked:
        text, result = next(results)
        assert rig.person_height == (None if text == "a" else 1.7)
        take.write_text(text)
        return result

    monkeypatch.setattr("zenocap.tools.takes.track._tracked", tracked)
    found = track(with_viewers(demo_rig("auto"), source=Actor("march", 1)), take := tmp_path / "a.mcap")
    assert take.read_text() == kept
    assert found.repeated == (kept == "b")
    assert [*tmp_path.iterdir()] == [take]


@pytest.mark.parametrize(("waited", "kept"), [(0, "a"), (20, "b")], ids=["T-pose at the start", "late"])
def test_two_view_uses_a_given_height_where_the_t_pose_comes_late(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, waited: int, kept: str
) -> None:
    results = iter([("a", Tracked(60, 30, 100, (), {}, waited=waited, height=1.7)), ("b", Tracked(60, 50, 100, (), {}))])

    def tracked(rig: Rig, take: Path, *_: object) -> Tracked:
        text, result = next(results)
        assert (rig.person_height, rig.height_estimated) == ((None if text == "a" else 1.8), False)
        take.write_text(text)
        return result

    monkeypatch.setattr("zenocap.tools.takes.track._tracked", tracked)
    rig = replace(with_viewers(demo_rig("two-view"), source=Actor("march", 1)), person_height=1.8)
    found = track(rig, take := tmp_path / "a.mcap")
    assert take.read_text() == kept
    assert (found.measured, found.height) == ((True, 1.7) if kept == "a" else (False, None))


@pytest.mark.nightly
def test_overlay_writes_pictures_and_a_video(short_rig: Rig, tmp_path: Path) -> None:
    overlay = Overlay(short_rig, tmp_path / "pictures", every=10)
    seen: list[TrackedFrameSet] = []

    def on_instant(instant: TrackedFrameSet) -> None:
        seen.append(instant)
        overlay.add(instant)

    track(short_rig, tmp_path / "a.mcap", on_instant)
    assert overlay.finish() == len(list((tmp_path / "pictures").glob("*.png"))) == -(-len(seen) // 10)
    with av.open(str(tmp_path / "pictures" / "overlay.mp4")) as film:  # in a codec that browsers play
        assert film.streams.video[0].codec_context.name == "h264"
        assert film.streams.video[0].frames == len(seen)


@pytest.mark.parametrize(
    ("source", "kind", "error"),
    [(Device(0), UserError, "viewer 1 is a live camera"), (Actor("flying", 0), SourceError, "flying")],
    ids=["live", "unknown"],
)
def test_a_source_that_cannot_be_tracked_is_an_error_and_leaves_no_take(
    source: Device | Actor, kind: type[UserError], error: str, short_rig: Rig, tmp_path: Path
) -> None:
    with pytest.raises(kind, match=error):
        track(with_viewers(short_rig, source=source), tmp_path / "a.mcap")
    assert not (tmp_path / "a.mcap").exists()


def test_other_aspect_ratios_are_rejected(short_rig: Rig) -> None:
    with pytest.raises(UserError, match=r"size 160x160: allowed: .* such as 160x120"):
        at_working_size(short_rig, (160, 160), None)


@pytest.mark.parametrize(("fps", "frames"), [(15.0, 40), (7.5, 20), (30.0, 40), (0.1, 1)])
def test_empty_scene_keeps_its_duration_at_a_lower_rate(short_rig: Rig, fps: float, frames: int) -> None:
    """A faster rate does not add frames: the video has no more."""
    at_rate = at_working_size(with_viewers(short_rig, fps=15.0, background=FirstFrames(40)), None, fps)
    assert [viewer.background for viewer in at_rate.viewers] == [FirstFrames(frames)] * 2
    assert [viewer.fps for viewer in at_rate.viewers] == [fps] * 2


@pytest.mark.nightly
def test_warm_up_reaches_poses_and_compiles_all_kernels() -> None:
    """All kernels are compiled by then, including the search of a lost limb and the lighting of images."""
    lines: list[str] = []
    for part in warmup.PARTS:
        warmup.warm_up(part, lines.append)
    assert any("searching" in line for line in lines)
    assert any("integrator: tracking" in line for line in lines)
    assert any("tracker: " in line for line in lines)
    assert all(kernel.signatures for kernel in (draw_floor, darken_floor, light_body, fill, develop))


def feedback_rig(*, feedback: bool) -> Rig:
    """The demo rig of the tracker, small, with a simulated person who raises both arms once."""
    small = at_working_size(demo_rig(), (160, 120), None)
    return with_viewers(small, source=Actor("raise-both-arms", 3), background=AdaptiveBackground(), feedback=feedback)


def silhouettes(take: Path) -> list[bytes]:
    return [one.message.data for one in TakeReader(take).envelopes((SILHOUETTE,), invalid="raise")]


@pytest.mark.nightly
def test_two_runs_are_equal_for_any_number_of_cores_and_the_poses_are_traced_inputs(tmp_path: Path) -> None:
    one, two, off = tmp_path / "one.mcap", tmp_path / "two.mcap", tmp_path / "off.mcap"
    result = track(feedback_rig(feedback=True), one, jobs=1)
    assert result.poses > 10
    assert result.problems == ()
    track(feedback_rig(feedback=True), two, jobs=2)
    assert one.read_bytes() == two.read_bytes()
    track(feedback_rig(feedback=False), off)
    assert len(silhouettes(one)) == len(silhouettes(off)) > 0
    assert silhouettes(one) != silhouettes(off)
    traces = [received.message for received in TakeReader(one).envelopes((HANDLED,), invalid="raise")]
    keys = {key for trace in traces if trace.service == "viewer" for key in trace.keys}
    assert any(key.endswith("tracker/pose") for key in keys)
    found = verify([one])
    assert sum(found.different.values()) == 0
    assert sum(found.equal.values()) > 0
