"""Conversion of a take's messages to a pose track; ranges and rows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from tests.support.foxglove_reader import in_envelope
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound, PoseTrack, between, every_frame, holding, rate_of
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.recording.setup_file import SETUP_FILE, recorded_rig, write_setup
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.rig.rig import demo_rig

START_NS = 1_700_000_000_000_000_000


def baps_of(track: PoseTrack) -> list[m.UniversalBap]:
    found = []
    for row, known in enumerate(track.known):
        angles = angles_by_name(TEN_PARTS, track.angles[row] if known else TEN_PARTS.neutral)
        x, y, z = track.positions[row] if known else (0.0, 0.0, 0.0)
        captured_ns, score = START_NS + round(track.times_s[row] * 1e9), float(track.scores["1"][row])
        found.append(built(
            m.UniversalBap, frame=int(track.frames[row]), captured_ns=captured_ns, position=(x, y, z), angles=angles,
            scores={"1": score}, views={"1": "facade"}, lost=[] if known else ["person"],
        ))  # fmt: skip
    return found


def messages_of_track(track: PoseTrack) -> list[m.Message]:
    camera = built(m.CameraInfo, captured_ns=START_NS)
    body = m.UniversalBdp(frame=0, captured_ns=START_NS, body=body_of(TEN_PARTS, track.bdp), ratio=1.0)
    return [camera, body, *baps_of(track)]


def write_take(path: Path, messages: list[m.Message], files: tuple[Attachment, ...] = ()) -> Path:
    recording = Recording(path, rig="studio", start_ns=START_NS, attachments=files)
    for message in messages:
        recording.record(in_envelope(message, received_ns=message.captured_ns))
    recording.close()
    return path


@pytest.mark.parametrize("tracker", [False, True])
def test_poses_of_a_take_round_trip_and_those_of_a_tracker_are_preferred(tmp_path: Path, tracker: bool) -> None:
    track = moving(20, first=3, lost=(4, 5), rate=25.0)
    messages = [*messages_of_track(moving(7, rate=25.0)), *tracker_messages(track)] if tracker else messages_of_track(track)
    found = read_poses(write_take(tmp_path / "a.mcap", messages)).track()
    np.testing.assert_array_equal(found.frames, track.frames)
    np.testing.assert_allclose(found.times_s, track.times_s, atol=1e-9)
    np.testing.assert_array_equal(found.positions, track.positions)
    np.testing.assert_array_equal(found.angles, track.angles)
    np.testing.assert_array_equal(found.scores["1"], np.full(20, np.nan) if tracker else track.scores["1"])
    assert found.views == ({"1": ("used",) * 20, "3": ("used",) * 20} if tracker else {"1": ("facade",) * 20})
    assert found.lost == track.lost
    assert found.rate == pytest.approx(25.0)
    np.testing.assert_array_equal(found.bdp.sizes, track.bdp.sizes)


def test_poses_are_sorted_by_capture_time(tmp_path: Path) -> None:
    messages = messages_of_track(moving(20))
    found = read_poses(write_take(tmp_path / "a.mcap", [*messages[:2], *reversed(messages[2:])]))
    assert list(found.frames) == list(range(20))


def test_frame_numbers_continue_by_time_after_a_viewer_restart(tmp_path: Path) -> None:
    one, two = moving(10, first=5, rate=10.0), moving(10, seed=2, first=0, rate=10.0)
    two = replace(two, times_s=two.times_s + 3.0)
    found = read_poses(write_take(tmp_path / "a.mcap", [*messages_of_track(one), *baps_of(two)]))
    assert list(found.frames) == [*range(5, 15), *range(30, 40)]
    assert (np.diff(found.times_s) > 0).all()


def tracker_messages(track: PoseTrack) -> list[m.Message]:
    """The same poses as messages of the tracker."""
    poses = [
        built(
            m.TrackerPose, frame=bap.frame, captured_ns=bap.captured_ns, position=bap.position, angles=bap.angles,
            lost=bool(bap.lost), views=["1", "3"],
        )
        for bap in baps_of(track)
    ]  # fmt: skip
    return [m.TrackerBdp(frame=0, captured_ns=START_NS, body=body_of(track.anatomy, track.bdp)), *poses]


@pytest.mark.parametrize("height", [None, 1.8])
def test_a_body_of_a_given_height_was_not_measured(height: float | None, tmp_path: Path) -> None:
    setup = write_setup(recorded_rig(replace(demo_rig("two-view"), person_height=height)))
    files = (Attachment(SETUP_FILE, "application/json", setup),)
    take = write_take(tmp_path / "a.mcap", messages_of_track(moving(5)), files)
    assert read_poses(take).measured == (height is None)


def of_twenty_parts() -> list[m.Message]:
    body = m.Body(anatomy="twenty-parts", sizes={}, offsets={})
    return [m.UniversalBdp(frame=0, captured_ns=START_NS, body=body, ratio=1.0), *baps_of(moving(3))]


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        (baps_of(moving(3)), "no universal BDP"),
        (messages_of_track(moving(3))[:2], "no universal BAP"),
        (tracker_messages(moving(3))[1:], r"a\.mcap: no tracker BDP: no T-pose was measured"),
        (of_twenty_parts(), r"a\.mcap: body: anatomy 'twenty-parts': allowed: ten-parts, fourteen-parts"),
    ],
    ids=["no body", "no pose", "no body of the tracker", "another anatomy"],
)
def test_a_take_without_body_or_pose_or_of_another_anatomy_is_refused(messages, words, tmp_path):
    take = write_take(tmp_path / "a.mcap", messages)
    with pytest.raises(UserError, match=words):
        read_poses(take)
    take.write_bytes(take.read_bytes()[:8])
    with pytest.raises(UserError, match=r"a\.mcap: cut before its end, 0 messages read: no universal BDP"):
        read_poses(take)


@pytest.mark.parametrize(
    ("first", "last", "frames"),
    [
        (None, None, range(3, 13)),
        (Bound(5), Bound(8), range(5, 9)),
        (Bound(0.5, True), None, range(5, 13)),
        (None, Bound(0.65, True), range(3, 7)),
        (Bound(0), Bound(99), range(3, 13)),
    ],
)
def test_both_ends_are_included(first: Bound | None, last: Bound | None, frames: range) -> None:
    assert list(between(moving(10, first=3, rate=10.0), first, last).frames) == list(frames)


def test_an_empty_range_raises_an_error_that_names_the_frames_of_the_take() -> None:
    with pytest.raises(UserError, match=r"leave no frame: allowed: frames 3 to 12, 0\.30s to 1\.20s"):
        between(moving(10, first=3, rate=10.0), Bound(13), None)


@given(first=st.integers(0, 20), gone=st.sets(st.integers(1, 8)))
def test_row_k_is_frame_k(first: int, gone: set[int]) -> None:
    track = moving(10, first=first, rate=10.0)
    kept = np.array([row for row in range(10) if row not in gone])
    dense = every_frame(track.rows(kept))
    assert list(dense.frames) == list(range(first + 10))
    np.testing.assert_allclose(dense.times_s, dense.frames / 10.0)
    np.testing.assert_array_equal(dense.positions[first + kept], track.positions[kept])
    assert np.count_nonzero(dense.known) == len(kept)


def test_too_many_rows_before_the_first_pose_are_refused() -> None:
    with pytest.raises(UserError, match="the first pose is of frame 200000, and rows count from 0: give --from"):
        every_frame(moving(first=200_000))


def test_holding_repeats_the_previous_pose() -> None:
    held = holding(moving(6, lost=(0, 3, 4)))
    assert held.known.all()
    np.testing.assert_array_equal(held.positions[[0, 3, 4]], held.positions[[1, 2, 2]])
    assert held.lost[3] == "person"


def test_the_rate_is_the_mean_over_all_rows() -> None:
    frames = np.array([0, 1, 2, 4, 8])
    assert rate_of(frames, np.array([0.0, 0.11, 0.19, 0.4, 0.8])) == pytest.approx(10.0)
    assert rate_of(frames[:1], np.array([0.0])) == 0.0
