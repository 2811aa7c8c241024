"""A rig with a tracker, offline, around a stand-in core: its take, and every reader of takes."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.command import app
from tests.support.tracker_stand_in import POSE, cameras, stand_in
from zenocap.common import messages as m
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import SourceError, UserError
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.recording.setup_file import PRIOR_FILE, SETUP_FILE
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import Actor, VideoFile
from zenocap.common.rig.tracker import TrackerOverrides, TrackerSpec
from zenocap.common.runtime.service import TooManyFailures
from zenocap.services.viewer import segmentation
from zenocap.tools.takes.rig_changes import with_tracker
from zenocap.tools.takes.track import TrackedFrameSet, track
from zenocap.tools.takes.verify.recompute import verify

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def core() -> Iterator[None]:
    with stand_in():
        yield


def hybrid(method: str = "hybrid") -> Rig:
    """Three cameras around the simulated person, who raises both arms."""
    rig = demo_rig("two-view")
    first = replace(rig.viewers[0], source=Actor("raise-both-arms", 3), preview=False)
    viewers = tuple(replace(first, id=id, camera=camera) for id, camera in cameras(3).items())
    spec = TrackerSpec(None, 40, 400, 4, 0, "ten-parts", "gauss-newton")
    return replace(rig, method=method, viewers=viewers, tracker=spec, recognizer=None)


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("take") / "a.mcap"
    seen: list[TrackedFrameSet] = []
    with stand_in():
        found = track(hybrid(), path, seen.append)
    assert found.problems == ()
    assert found.states["tracker"] == "tracking"
    assert found.states["viewer 3"] == "silhouettes only"
    assert seen[-1].state == "tracking"
    assert found.poses > 50
    return path


@pytest.mark.nightly
def test_the_take_does_not_depend_on_the_number_of_cores(tmp_path: Path) -> None:
    for jobs in (1, 2, 5):
        track(hybrid(), tmp_path / f"{jobs}.mcap", jobs=jobs)
    assert (tmp_path / "1.mcap").read_bytes() == (tmp_path / "2.mcap").read_bytes() == (tmp_path / "5.mcap").read_bytes()


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_unreadable_video_is_named_with_any_number_of_cores(tmp_path: Path, jobs: int) -> None:
    video = tmp_path / "cam2.mp4"
    video.write_bytes(b"no video")
    rig = hybrid()
    viewers = tuple(replace(v, source=VideoFile(video)) if v.id == "2" else v for v in rig.viewers)
    with pytest.raises(SourceError, match=r"cam2\.mp4: not a video that can be decoded"):
        track(replace(rig, viewers=viewers), tmp_path / "a.mcap", jobs=jobs)
    assert not (tmp_path / "a.mcap").exists()


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_failing_step_is_counted_with_any_number_of_cores(tmp_path, jobs, monkeypatch):
    monkeypatch.setattr(segmentation, "extract", Mock(side_effect=ValueError("no silhouette")))
    with pytest.raises(TooManyFailures, match="10 steps in a row failed, the last on frame"):
        track(hybrid(), tmp_path / "a.mcap", jobs=jobs)


def messages_of(path: Path, kind: type[m.Message]) -> list[m.Message]:
    received = [envelope(recorded) for recorded in TakeReader(path).messages()]
    return [each.message for each in received if each is not None and isinstance(each.message, kind)]


def test_the_take_has_silhouettes_of_every_frame_and_the_trackers_poses(take: Path) -> None:
    silhouettes, poses = messages_of(take, m.Silhouette), messages_of(take, m.TrackerPose)
    frames = {
        viewer: [s.frame for s in silhouettes if isinstance(s, m.Silhouette) and s.viewer == viewer] for viewer in "123"
    }
    assert frames["1"] == frames["2"] == frames["3"] == list(range(frames["1"][0], frames["1"][-1] + 1))
    assert [pose.frame for pose in poses] == list(range(poses[0].frame, frames["1"][-1] + 1))
    assert len(messages_of(take, m.TrackerBdp)) == 1
    for kind in (m.Sighting, m.PartialBdp, m.Assignment, m.UniversalBap):
        assert messages_of(take, kind) == []


@pytest.mark.nightly
def test_poses_of_the_take_are_exported_summarized_and_evaluated(take: Path, tmp_path: Path) -> None:
    poses = read_poses(take)
    last = poses.track().trajectories().points[-1]
    np.testing.assert_allclose(last, joint_centres(poses.anatomy, poses.bdp, POSE), atol=1e-9)
    for to in ("trc", "bvh", "c3d", "csv"):
        result = CliRunner().invoke(app, ["export", str(take), "--to", to, "-o", str(tmp_path / f"a.{to}")])
        assert result.exit_code == 0, result.output
    result = CliRunner().invoke(app, ["info", str(take)])
    assert "tracker/pose" in result.output
    count = len(poses.baps)
    assert f"tracker     {count} poses, 0 without a person, {count} of 3 views" in result.output
    result = CliRunner().invoke(app, ["evaluate", str(take), "--truth", str(tmp_path / "a.trc"), "--json"])
    assert '"mpjpe_mm": 0.0' in result.output


def with_attachments(take: Path, path: Path, files: dict[str, bytes]) -> Path:
    """The take with other attachments."""
    recording = Recording(
        path, rig="demo", start_ns=0, attachments=tuple(Attachment(name, "", data) for name, data in files.items())
    )
    for recorded in TakeReader(take).messages():
        received = envelope(recorded)
        if received is not None:
            recording.record(received)
    assert recording.close().failure is None
    return path


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        (None, r"attachment tracker\.prior is missing"),
        (b"another", r"attachment tracker\.prior: sha256 = ae448ac86c4e\.\.\.: allowed: 000000000000"),
    ],
)
def test_a_take_without_its_prior_cannot_be_recomputed(take: Path, tmp_path: Path, prior: bytes | None, words: str) -> None:
    setup = TakeReader(take)
    list(setup.messages())
    data = setup.attachments[SETUP_FILE].replace(b'"prior_sha256": null', b'"prior_sha256": "' + b"0" * 64 + b'"')
    files = {SETUP_FILE: data} | ({} if prior is None else {PRIOR_FILE: prior})
    with pytest.raises(UserError, match=words):
        verify([with_attachments(take, tmp_path / "b.mcap", files)])


def test_tracker_options_without_a_tracker_raise_an_error() -> None:
    assert with_tracker(demo_rig("two-view"), TrackerOverrides()).tracker is None
    changed = with_tracker(hybrid(), TrackerOverrides(particles=7, seed=3)).tracker
    assert (changed.particles, changed.seed, changed.points) == (7, 3, 400)
    with pytest.raises(UserError, match=r"method = 'two-view' has no tracker: allowed with .*: hybrid, image-force"):
        with_tracker(demo_rig("two-view"), TrackerOverrides(seed=3))
    with pytest.raises(UserError, match=r"--particles = 7: allowed: 1 for method 'image-force'"):
        with_tracker(hybrid("image-force"), TrackerOverrides(particles=7))
