"""Tracking both ways: forward poses stay, the better ones are the default."""

import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import zenocap
from tests.support.arms_takes import arms_rig
from tests.support.built_messages import built, silhouette
from tests.support.command import zenocap as command
from tests.support.tracker_ring import FRAME_NS, ring, setup
from tests.tools.takes.verify.test_verify import altering, changed, totals
from zenocap.common import messages as m
from zenocap.common.body.definition import Pose
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import read_poses, summary_of
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, read_setup
from zenocap.common.rig.rig import Rig, demo_rig, demo_rig_file, load_rig
from zenocap.common.rig.tracker import TrackerOverrides
from zenocap.common.topics import BOTH_WAYS_POSE, TRACKER_POSE, VERDICT
from zenocap.services.animator.playback import topics_shown
from zenocap.services.animator.states import TOPICS
from zenocap.services.tracker.both_ways.passes import BACKWARDS, CHOOSING, ForwardPose, FusedPose, Watch
from zenocap.services.tracker.filter.confidence import LIMBS, Confidence
from zenocap.services.tracker.shell import setup_of
from zenocap.services.tracker.states import TrackerSetup
from zenocap.tools.takes.both_ways import (
    WRITING,
    _scenes_backwards,
    both_ways,
    both_ways_message,
    has_second_pass,
    track_both_ways,
)
from zenocap.tools.takes.info import info
from zenocap.tools.takes.info_text import lines_of
from zenocap.tools.takes.overlay import Overlay
from zenocap.tools.takes.rig_changes import with_tracker
from zenocap.tools.takes.track import Tracked, TrackedFrameSet, frame_sets_again, track
from zenocap.tools.takes.verify.recompute import verify

KEY = "zenocap/demo/tracker/both_ways"


@pytest.mark.nightly
@pytest.mark.parametrize("jobs", [1, 2])
def test_on_any_number_of_cores_the_second_pass_names_what_it_does_and_the_take_is_the_same(
    takes: tuple[Path, Path], tmp_path: Path, jobs: int
) -> None:
    calls: list[tuple[str, int, int]] = []
    result = track_both_ways(arms_rig(), tmp_path / "both.mcap", watch=lambda *one: calls.append(one), jobs=jobs)
    assert result.problems == ()
    assert result.both_ways
    assert list(dict.fromkeys(activity for activity, *_ in calls)) == [BACKWARDS, CHOOSING, WRITING]
    assert all(done <= total == result.poses for _, done, total in calls)
    assert [path.name for path in tmp_path.iterdir()] == ["both.mcap"]
    assert (tmp_path / "both.mcap").read_bytes() == takes[1].read_bytes()


def arms_file(folder: Path) -> Path:
    """The demo's rig file with a person who raises both arms once."""
    for file in demo_rig().files:
        (folder / file.name).write_text(file.read_text().replace("actor:demo?seed=4", "actor:raise-both-arms?seed=3"))
    return folder / demo_rig_file().name


def messages(path: Path) -> list[Envelope]:
    return list(TakeReader(path).envelopes(invalid="raise"))


@pytest.mark.slow
def test_all_messages_of_the_forward_pass_stay_as_they_are(takes: tuple[Path, Path]) -> None:
    forward, both = (messages(path) for path in takes)
    kept = [one for one in both if one.topic is not BOTH_WAYS_POSE]
    assert kept[-1].topic is forward[-1].topic is VERDICT  # each on its own poses
    assert [(one.key, one.data, one.received_ns) for one in kept[:-1]] == [
        (one.key, one.data, one.received_ns) for one in forward[:-1]
    ]


@pytest.mark.slow
def test_every_pose_has_one_from_both_directions_behind_it(takes: tuple[Path, Path]) -> None:
    poses = [one for one in messages(takes[1]) if isinstance(one.message, m.TrackerPose)]
    assert len(poses) > 50
    for raw, fused in zip(poses[::2], poses[1::2], strict=True):
        assert (raw.topic, fused.topic) == (TRACKER_POSE, BOTH_WAYS_POSE)
        assert (raw.message.frame, raw.message.captured_ns) == (fused.message.frame, fused.message.captured_ns)
        assert isinstance(fused.message, m.BothWaysPose)
        assert set(fused.message.backward) == {"trunk", "right_arm", "left_arm", "right_leg", "left_leg"}


@pytest.mark.slow
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
        assert command("export", both, "-o", tmp_path / f"{name}.csv", *options)[0] == 0
    zenocap.open_take(forward).export(tmp_path / "forward.csv")
    assert (tmp_path / "raw.csv").read_text() == (tmp_path / "forward.csv").read_text()
    assert (tmp_path / "fused.csv").read_text() != (tmp_path / "raw.csv").read_text()


@pytest.mark.slow
def test_foxglove_and_the_page_show_the_better_poses(takes: tuple[Path, Path], tmp_path: Path) -> None:
    forward, both = takes
    scenes = [[one for one in TakeReader(path).messages() if one.topic == "foxglove/demo/pose"] for path in takes]
    assert len(scenes[0]) == len(scenes[1]) == len(read_poses(forward).frames)
    assert scenes[0][-20].data != scenes[1][-20].data
    assert topics_shown(forward, TOPICS) == TOPICS
    shown = topics_shown(both, TOPICS)
    assert topics_shown(both, TOPICS, raw=True) == TOPICS
    assert BOTH_WAYS_POSE in shown
    assert TRACKER_POSE not in shown
    cut = tmp_path / "cut.mcap"
    for size in (0, 5, 100, both.stat().st_size // 2):
        cut.write_bytes(both.read_bytes()[:size])
        assert topics_shown(cut, TOPICS) == TOPICS


@pytest.mark.nightly
def test_both_directions_are_recomputed_to_equal_bytes(takes: tuple[Path, Path], tmp_path: Path) -> None:
    found = verify([takes[1]])
    assert found.complete
    assert not found.failed
    assert found.equal[KEY] == len(read_poses(takes[1]).frames)
    frame = int(read_poses(takes[1]).frames[20])
    change = altering(m.BothWaysPose, frame, lambda _: {"position": (0.0, 1.0, 9.0)})
    found = verify([changed(takes[1], tmp_path / "changed.mcap", change)])
    assert totals(found)[1] == found.different[KEY] == 1
    assert found.first is not None
    assert (found.first.key, found.first.frame) == (KEY, frame)


@pytest.mark.slow
def test_a_cut_take_says_that_both_directions_were_not_checked(takes: tuple[Path, Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(takes[1].read_bytes()[: takes[1].stat().st_size * 3 // 4])
    found = verify([cut])
    assert not found.complete
    assert any("both directions: only of a whole take" in str(reason) for reason in found.reasons)


@pytest.mark.nightly
@pytest.mark.parametrize(("options", "both_ways"), [({}, True), ({"both_ways": False}, False)])
def test_python_tracks_both_ways_unless_told_otherwise(
    takes: tuple[Path, Path], tmp_path: Path, options: dict[str, bool], both_ways: bool
) -> None:
    assert zenocap.track(arms_rig(), tmp_path / "a.mcap", **options).both_ways is both_ways
    assert (tmp_path / "a.mcap").read_bytes() == takes[both_ways].read_bytes()


@pytest.fixture
def first_pass(takes: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """The forward pass gives the stored take: other tests run it."""

    def stored(rig: Rig, take: Path, *_: object) -> Tracked:
        shutil.copy(takes[0], take)
        poses = len(read_poses(take).frames)
        return Tracked(frame_sets=poses, poses=poses, messages=0, problems=(), states={})

    monkeypatch.setattr("zenocap.tools.takes.both_ways.track", stored)


def full(_: int) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.nightly
@pytest.mark.usefixtures("first_pass")
@pytest.mark.parametrize("activity", [BACKWARDS, WRITING])
@pytest.mark.parametrize("cause", ["interrupted", "full disk"])
def test_a_second_pass_that_ends_early_leaves_the_take_of_the_forward_pass(
    takes: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cause: str, activity: str
) -> None:
    def end(now: str, done: int, _: int) -> None:
        if now == activity and done == 20:
            if cause == "interrupted":
                raise KeyboardInterrupt
            monkeypatch.setattr("zenocap.common.recording.writer.os.fsync", full)

    with pytest.raises(KeyboardInterrupt) if cause == "interrupted" else nullcontext():
        result = track_both_ways(arms_rig(), tmp_path / "a.mcap", watch=end)
        (problem,) = result.problems
        assert "second pass: " in problem
        assert "No space left on device" in problem
        assert problem.endswith("the poses are those of the forward pass")
        assert not result.both_ways
    assert (tmp_path / "a.mcap").read_bytes() == takes[0].read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    assert "both ways   no: tracked in one pass" in lines_of(info(tmp_path / "a.mcap"))
    assert not zenocap.open_take(tmp_path / "a.mcap").both_ways


@pytest.mark.nightly
def test_no_second_pass_follows_a_take_that_could_not_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fill(_: TrackedFrameSet) -> None:
        monkeypatch.setattr("zenocap.common.recording.writer.os.fsync", full)

    calls: list[str] = []
    result = track_both_ways(arms_rig(), tmp_path / "a.mcap", fill, lambda now, *_: calls.append(now))
    assert (calls, result.both_ways, result.complete, len(result.problems)) == ([], False, False, 1)


@pytest.mark.nightly
def test_a_take_without_silhouettes_cannot_be_tracked_backwards(takes: tuple[Path, Path], tmp_path: Path) -> None:
    path = changed(takes[1], tmp_path / "a.mcap", lambda one: None if isinstance(one.message, m.Silhouette) else one)
    found = verify([path])
    assert found.unchecked[KEY] == len(read_poses(path).frames)
    assert any("no silhouettes: they are needed for a second pass" in str(reason) for reason in found.reasons)


@pytest.mark.nightly
def test_poses_without_silhouettes_are_those_of_the_forward_pass(takes: tuple[Path, Path], tmp_path: Path) -> None:
    """A gap in the silhouettes: no pose is lost there."""
    poses = read_poses(takes[0])
    gap = {bap.captured_ns for bap in poses.baps[20:25]}
    path = changed(
        takes[0], tmp_path / "a.mcap",
        lambda one: None if isinstance(one.message, m.Silhouette) and one.message.captured_ns in gap else one,
    )  # fmt: skip
    attached = TakeReader(path)
    assert list(attached.messages())
    recorded = read_setup(path, attached.attachments[SETUP_FILE])
    found = both_ways(path, recorded.name, setup_of(recorded, None))
    for bap in poses.baps[20:25]:
        np.testing.assert_allclose(found[bap.captured_ns].pose.angles, poses.pose(bap).angles, atol=1e-9)
        assert not found[bap.captured_ns].lost


def test_a_frozen_view_is_left_out_backwards_from_its_first_picture_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frozen from frame 3 to frame 8; forwards it was left out from frame 6 on."""
    config, count = setup(ring(2)), 12
    shown = {"1": range(count), "2": [*range(3), *[3] * 6, *range(9, count)]}  # by viewer, the picture of each frame
    silhouettes = [
        silhouette(viewer, k, k * FRAME_NS, np.eye(8 + which[k], dtype=np.uint8))
        for k in range(count)
        for viewer, which in shown.items()
    ]
    pose = Pose(np.zeros(3), config.anatomy.neutral)
    forward = [ForwardPose(k * FRAME_NS, pose, False, ("1",) if 6 <= k <= 8 else ("1", "2")) for k in range(count)]
    monkeypatch.setattr("zenocap.tools.takes.both_ways._silhouettes_backwards", lambda *_: reversed(silhouettes))
    found = {one.captured_ns // FRAME_NS: set(masks) for one, masks in _scenes_backwards(Path(), "demo", config, forward)}
    assert found == {k: {"1"} if 3 <= k <= 8 else {"1", "2"} for k in range(count)}


@pytest.mark.parametrize(
    ("backward", "limbs", "lost", "heading"),
    [
        (Confidence(dict.fromkeys(LIMBS, 0.2), 0.3), (0.9, 0.2, 0.9, 0.2), ["left_arm", "left_leg"], 0.3),
        (Confidence({}, None), (0.9, None, 0.9, None), [], None),  # a preset that states none
        (None, (0.9, 0.9, 0.9, 0.9), [], 0.8),  # the pose of the forward pass, with which the backward pass begins
    ],
)
def test_each_limb_and_the_heading_are_as_certain_as_in_the_pass_that_they_are_taken_from(
    backward: Confidence | None, limbs: tuple[float | None, ...], lost: list[str], heading: float | None
) -> None:
    config = setup(ring(2))
    forward = built(m.TrackerPose, limbs=dict.fromkeys(LIMBS, 0.9), heading=0.8)
    pose, shares = Pose(np.zeros(3), config.anatomy.neutral), np.array([1.0, 0.4, 0.5, 0.0, 1.0])
    found = both_ways_message(config, forward, FusedPose(pose, shares, confidence=backward))
    assert (tuple(map(found.limbs.get, LIMBS)), found.lost_limbs, found.heading) == (limbs, lost, heading)


@pytest.mark.nightly
def test_the_frame_sets_are_read_again_with_the_messages_of_the_take(takes: tuple[Path, Path], tmp_path: Path) -> None:
    seen: list[TrackedFrameSet] = []
    track(arms_rig(), tmp_path / "a.mcap", seen.append)
    again = list(frame_sets_again(arms_rig(), takes[1]))
    assert len(again) == len(seen)
    for first, second in zip(seen, again, strict=True):
        for id, frame in first.frames.items():
            assert (frame.frame, frame.captured_ns) == (second.frames[id].frame, second.frames[id].captured_ns)
            np.testing.assert_array_equal(frame.image, second.frames[id].image)
        kept = [one for one in second.messages if not isinstance(one, m.BothWaysPose | m.Handled | m.Verdict)]
        assert kept == [one for one in first.messages if not isinstance(one, m.Handled)]
        poses = [type(one) for one in second.messages if isinstance(one, m.TrackerPose)]
        assert poses in ([], [m.TrackerPose, m.BothWaysPose])


@pytest.mark.nightly
def test_an_overlay_shows_the_pose_of_both_passes_on_the_last_body(takes: tuple[Path, Path], tmp_path: Path) -> None:
    summary = summary_of(takes[1])
    frame_set = list(frame_sets_again(arms_rig(), takes[1]))[-20]
    (fused,) = (one for one in frame_set.messages if isinstance(one, m.BothWaysPose))

    def drawn(*messages: m.Message) -> NDArray[np.uint8]:
        overlay = Overlay(arms_rig(), tmp_path, every=1)
        overlay.use_body(summary.anatomy, summary.bdp)
        overlay.add(replace(frame_set, messages=messages))
        assert overlay.finish() == 1
        (path,) = tmp_path.glob("*.png")
        return cv2.imread(str(path))

    np.testing.assert_array_equal(drawn(*frame_set.messages), drawn(*frame_set.messages, fused))
    raw = [one for one in frame_set.messages if one is not fused]
    assert (drawn(*raw) != drawn(*frame_set.messages)).any()


@pytest.mark.nightly
def test_the_command_tracks_both_ways_unless_told_otherwise(takes: tuple[Path, Path], tmp_path: Path) -> None:
    studio = arms_file(tmp_path)
    status, text, err = command("track", studio, "-o", tmp_path / "a.mcap", "--overlay", tmp_path / "pictures")
    text += err
    assert status == 0
    assert "poses tracked both ways" in text
    assert "the poses of the forward pass are in it too: --raw" in text
    assert "pictures and overlay.mp4, poses tracked both ways" in text
    assert zenocap.open_take(tmp_path / "a.mcap").both_ways
    status, text, err = command("track", studio, "-o", tmp_path / "b.mcap", "--no-both-ways")
    assert (status, "both ways" in text + err, "--raw" in text + err) == (0, False, False)
    arguments = ("evaluate", tmp_path / "a.mcap", "--centres", "--truth", tmp_path / "b.mcap")
    raw, fused = command(*arguments, "--raw"), command(*arguments)
    assert (raw[0], fused[0]) == (0, 0)
    assert "mpjpe_mm   0.00" in raw[1]
    assert "mpjpe_mm   0.00" not in fused[1]
    assert "both ways" in "\n".join(lines_of(info(tmp_path / "a.mcap")))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("function", "output", "words"),
    [
        ("both_ways", "a.mcap", "interrupted in the second pass: {} is complete, with the poses of the forward pass"),
        ("frame_sets_again", "a.mcap", "interrupted while the pictures were drawn: {} is complete, with the poses of both"),
        ("both_ways", "a.bvh", None),
    ],
)
def test_an_interrupted_command_names_what_it_leaves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, function: str, output: str, words: str | None
) -> None:
    def interrupt(take: Path, rig: str, setup: TrackerSetup, watch: Watch, jobs: int) -> None:
        watch(BACKWARDS, 1, 2)
        raise KeyboardInterrupt

    def interrupt_drawing(rig: Rig, take: Path, jobs: int | None) -> None:
        raise KeyboardInterrupt

    if function == "both_ways":
        monkeypatch.setattr("zenocap.tools.takes.both_ways.both_ways", interrupt)
    else:
        monkeypatch.setattr("zenocap.tools.takes.track_job.frame_sets_again", interrupt_drawing)
    path, pictures = tmp_path / output, tmp_path / "pictures"
    status, out, err = command("track", arms_file(tmp_path), "-o", path, "--overlay", pictures)
    assert status != 0
    assert ("interrupted" in out + err) is (words is not None)
    assert (words or "").format(path) in out + err
    assert path.exists() is (words is not None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "preset", "default"),
    [("hybrid", "default", True), ("hybrid", "paper", False), ("image-force", "default", False), ("two-view", None, False)],
)
def test_only_the_method_hybrid_has_a_second_pass_by_default(method: str, preset: str | None, default: bool) -> None:
    rig = load_rig(demo_rig_file("two-view" if method == "two-view" else "auto"), method)
    rig = with_tracker(rig, TrackerOverrides(preset=preset))
    assert has_second_pass(rig) is default
    assert not has_second_pass(rig, False)
    if method != "two-view":
        assert has_second_pass(rig, True)


@pytest.mark.slow
def test_two_view_has_no_tracker(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="method = 'two-view': allowed with --both-ways: hybrid"):
        track_both_ways(demo_rig("two-view"), tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())
