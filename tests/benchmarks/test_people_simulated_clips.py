"""Simulated clips of the evaluation: what is in them, and their priors."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases.clips import FIRST_PERSON, take_prior
from benchmarks.harness.case import SHARED
from benchmarks.people.films import filmed, motion_file
from benchmarks.people.simulated_clips import (
    CHAIN,
    SIZE,
    STANDING,
    STEP_M,
    TEST_FRAMES,
    TRAINING_FRAMES,
    cameras_of,
    cycle_clip,
    filmed_clip,
    held_clip,
    performed_clip,
    simulated_clip,
)
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import LEFT, RIGHT, neutral
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import t_pose
from zenocap.tools.teach.dataset import build_priors

FILE = SHARED / motion_file("07_01")
SUBJECT = person(3)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path))


@pytest.mark.nightly
def test_empty_frames_are_left_out_and_views_agree_with_the_truth() -> None:
    """Every joint is inside of the silhouette of every view."""
    clip = simulated_clip(SUBJECT, [None, t_pose(SUBJECT), neutral(SUBJECT)], 2, 30.0, 2)
    assert [instant.frame for instant in clip.instants] == [1, 2]
    assert clip.instants[1].captured_ns == round(2e9 / 30)
    assert clip.truth.frames.tolist() == [1, 2]
    for row, instant in enumerate(clip.instants):
        for view, mask in clip.masks(instant, clip.cameras).items():
            assert mask.shape == SIZE[::-1]
            pixels = clip.cameras[view].project(clip.truth.points[row])
            columns, rows = np.rint(pixels).astype(int).T
            inside = mask[rows, columns]
            assert inside.mean() > 0.85, view


@pytest.mark.slow
def test_silhouettes_of_the_same_poses_are_rendered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    first, other = (simulated_clip(SUBJECT, [pose(SUBJECT)], 0, 30.0, 2) for pose in (t_pose, neutral))
    monkeypatch.setattr("benchmarks.people.simulated_clips.SimulatedCamera", None)
    again = simulated_clip(SUBJECT, [t_pose(SUBJECT)], 0, 30.0, 2)
    for view in first.cameras:
        assert np.array_equal(first.instants[0].masks[view], again.instants[0].masks[view])
        assert not np.array_equal(first.instants[0].masks[view], other.instants[0].masks[view])


@pytest.mark.parametrize(
    "motion", [STANDING, pytest.param("07_01", marks=pytest.mark.skipif(not FILE.is_file(), reason=f"{FILE} missing"))]
)
@pytest.mark.parametrize(("ahead", "sign"), [(RIGHT, 1.0), (LEFT, -1.0)])
def test_a_step_is_held_in_its_heading_before_the_motion(
    motion: str, ahead: int, sign: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.people.simulated_clips.simulated_clip", lambda *given: given)
    subject, poses, first, *_ = held_clip(3, 120, ahead, motion, 2, 10.0)
    held = [truth(subject, pose).joints for pose in poses[first : first + 30]]
    apart = np.array([one["RAnkle"] - one["LAnkle"] for one in held])
    ahead_of_other = apart @ [np.sin(np.radians(120.0)), 0.0, np.cos(np.radians(120.0))]
    np.testing.assert_allclose(ahead_of_other, sign * STEP_M, atol=0.02)
    np.testing.assert_allclose(apart[:, 1], 0.0, atol=0.02)
    assert len(poses) >= first + 60


@pytest.mark.parametrize("motion", [CHAIN, "march"])
def test_a_performed_clip_is_an_opening_and_seconds_of_its_motion(motion: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.people.simulated_clips.simulated_clip", lambda *given: given)
    subject, poses, first, *_ = performed_clip(3, motion, 2, 5.0, 4.0)
    assert poses[0] is None
    assert len(poses) == first + 20
    joints = [list(truth(subject, pose).joints.values()) for pose in poses[first:]]
    assert np.ptp(joints, axis=0).max() > 0.1


@pytest.mark.slow
def test_a_film_that_is_coded_and_read_back_has_the_person_where_the_truth_is() -> None:
    clip = filmed_clip(filmed(SUBJECT, [*[None] * 10, *[neutral(SUBJECT)] * 5], 12, (160, 120), 3), 0)
    assert (clip.motion_from, [one.frame for one in clip.instants]) == (12, [*range(10, 15)])
    assert clip.truth.frames.tolist() == [*range(10, 15)]
    for view, mask in clip.masks(clip.instants[-1], clip.cameras).items():
        rows, columns = np.nonzero(mask)
        head = clip.cameras[view].project(clip.truth.points[-1, [clip.truth.names.index("Head")]])[0]
        assert np.abs(columns - head[0]).min() < 2.0
        assert rows.min() - 6.0 < head[1] < rows.min() + 10.0


def test_unknown_name_of_a_clip() -> None:
    with pytest.raises(ValueError, match="clip dancing-3: allowed: a shared clip, or walking"):
        cycle_clip("dancing-3")


@pytest.mark.nightly
def test_a_cycle_has_the_papers_numbers_of_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TEST_FRAMES, "walking", 3)
    monkeypatch.setattr("benchmarks.people.simulated_clips.CYCLE_FPS", 5.0)
    monkeypatch.setattr("benchmarks.people.simulated_clips.cameras_of", lambda *_: dict([*cameras_of(7).items()][:1]))
    clip = cycle_clip("walking-3")
    motion = clip.truth.frames >= clip.motion_from
    assert int(motion.sum()) == TRAINING_FRAMES + 3


def test_people_are_used_for_nothing_else() -> None:
    people = range(FIRST_PERSON, FIRST_PERSON + 3)
    assert not set(people) & {*build_priors.PEOPLE, build_priors.HELD_PERSON}
    assert take_prior("walking-120", TRAINING_FRAMES, paper=True).endswith("@20")
