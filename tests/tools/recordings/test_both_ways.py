"""Tracking both ways: the forward poses stay as they are, the better ones are beside them and used by default."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

import zenocap
from tests.tools.verify.test_verify import changed, totals, with_message
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import Actor
from zenocap.common.topics import BOTH_WAYS_POSE, TRACKER_POSE
from zenocap.services.animator.playback import topics_shown
from zenocap.services.animator.shell import TOPICS
from zenocap.tools.cli.main import app
from zenocap.tools.recordings.both_ways import track_both_ways
from zenocap.tools.recordings.track import track
from zenocap.tools.verify.recompute import verify

pytestmark = pytest.mark.slow
KEY = "zenocap/demo/tracker/both_ways"


@pytest.fixture(scope="module")
def rig() -> Rig:
    rig = demo_rig()
    return replace(rig, viewers=tuple(replace(viewer, source=Actor("raise-both-arms", 3)) for viewer in rig.viewers))


@pytest.fixture(scope="module")
def takes(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same videos tracked forwards only, and both ways."""
    folder = tmp_path_factory.mktemp("takes")
    track(rig, folder / "forward.mcap")
    calls: list[tuple[int, int]] = []
    result = track_both_ways(rig, folder / "both.mcap", watch=lambda done, total: calls.append((done, total)))
    assert result.problems == ()
    assert calls[-1][0] <= calls[-1][1] == result.poses
    assert sorted(path.name for path in folder.iterdir()) == ["both.mcap", "forward.mcap"]
    return folder / "forward.mcap", folder / "both.mcap"


def messages(path: Path) -> list[Envelope]:
    return [received for recorded in Take(path).messages() if (received := envelope(recorded)) is not None]


def test_all_messages_of_the_forward_pass_stay_as_they_are(takes: tuple[Path, Path]) -> None:
    forward, both = (messages(path) for path in takes)
    kept = [one for one in both if one.topic is not BOTH_WAYS_POSE]
    assert [(one.key, one.data, one.received_ns) for one in kept] == [
        (one.key, one.data, one.received_ns) for one in forward
    ]


def test_every_pose_has_one_from_both_directions_behind_it(takes: tuple[Path, Path]) -> None:
    poses = [one for one in messages(takes[1]) if isinstance(one.message, m.TrackerPose)]
    assert len(poses) > 50
    for raw, fused in zip(poses[::2], poses[1::2], strict=True):
        assert (raw.topic, fused.topic) == (TRACKER_POSE, BOTH_WAYS_POSE)
        assert (raw.message.frame, raw.message.captured_ns) == (fused.message.frame, fused.message.captured_ns)
        assert isinstance(fused.message, m.BothWaysPose)
        assert set(fused.message.backward) == {"trunk", "right_arm", "left_arm", "right_leg", "left_leg"}


def test_readers_use_the_better_poses_and_raw_ones_on_request(takes: tuple[Path, Path], tmp_path: Path) -> None:
    forward, both = takes
    raw = read_poses(forward).track()
    np.testing.assert_array_equal(read_poses(both, raw=True).track().angles, raw.angles)
    fused = read_poses(both).track()
    np.testing.assert_array_equal(fused.frames, raw.frames)
    assert np.nanmax(np.abs(fused.angles - raw.angles)) > 0.001
    assert np.nanmean(np.linalg.norm(fused.positions - raw.positions, axis=1)) < 0.05
    np.testing.assert_array_equal(zenocap.open_take(both).poses().angles, fused.angles)
    np.testing.assert_array_equal(zenocap.open_take(both, raw=True).poses().angles, raw.angles)
    for name, options in (("fused", []), ("raw", ["--raw"])):
        found = CliRunner().invoke(app, ["export", str(both), "-o", str(tmp_path / f"{name}.csv"), *options])
        assert found.exit_code == 0
    zenocap.open_take(forward).export(tmp_path / "forward.csv")
    assert (tmp_path / "raw.csv").read_text() == (tmp_path / "forward.csv").read_text()
    assert (tmp_path / "fused.csv").read_text() != (tmp_path / "raw.csv").read_text()


def test_foxglove_and_the_page_show_the_better_poses(takes: tuple[Path, Path], tmp_path: Path) -> None:
    forward, both = takes
    scenes = [[one for one in Take(path).messages() if one.topic == "foxglove/demo/pose"] for path in takes]
    assert len(scenes[0]) == len(scenes[1]) == len(read_poses(forward).frames)
    assert scenes[0][-20].data != scenes[1][-20].data
    assert topics_shown(forward, TOPICS) == TOPICS
    shown = topics_shown(both, TOPICS)
    assert BOTH_WAYS_POSE in shown
    assert TRACKER_POSE not in shown
    cut = tmp_path / "cut.mcap"
    for size in (0, 5, 100, both.stat().st_size // 2):
        cut.write_bytes(both.read_bytes()[:size])
        assert topics_shown(cut, TOPICS) == TOPICS


def test_both_directions_are_recomputed_to_equal_bytes(takes: tuple[Path, Path], tmp_path: Path) -> None:
    found = verify([takes[1]])
    assert found.complete
    assert not found.failed
    assert found.equal[KEY] == len(read_poses(takes[1]).frames)
    frame = int(read_poses(takes[1]).frames[20])

    def change(received: Envelope) -> Envelope:
        if isinstance(received.message, m.BothWaysPose) and received.message.frame == frame:
            return with_message(received, msgspec.structs.replace(received.message, position=(0.0, 1.0, 9.0)))
        return received

    found = verify([changed(takes[1], tmp_path / "changed.mcap", change)])
    assert totals(found)[1] == found.different[KEY] == 1
    assert found.first is not None
    assert (found.first.key, found.first.frame) == (KEY, frame)


def test_a_cut_take_says_that_both_directions_were_not_checked(takes: tuple[Path, Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(takes[1].read_bytes()[: takes[1].stat().st_size * 3 // 4])
    found = verify([cut])
    assert not found.complete
    assert any("both directions: only of a whole take" in str(reason) for reason in found.reasons)


def test_two_runs_give_equal_bytes(rig: Rig, takes: tuple[Path, Path], tmp_path: Path) -> None:
    track_both_ways(rig, tmp_path / "again.mcap")
    assert (tmp_path / "again.mcap").read_bytes() == takes[1].read_bytes()


def test_two_view_has_no_tracker(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="method = 'two-view': allowed with --both-ways: hybrid"):
        track_both_ways(demo_rig("two-view"), tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())
