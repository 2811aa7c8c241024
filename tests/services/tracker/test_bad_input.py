"""Bad input through the tracker's step: findings, tracking with the other views."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support.built_messages import silhouette
from tests.support.tracker_ring import FRAME_NS, hip_error, in_motion, rendered_masks, ring, setup, t_pose_at
from tests.support.tracker_steps import track_each
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import TrackerState
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.body.rotation import rx

pytestmark = pytest.mark.slow

SEED, VIEWS, STANDING = 12, 5, 70
CAMERAS = ring(VIEWS)
BAD = "2"
ALL, SHORT = range(140), range(64, 174)  # frames: with a long T-pose, and with a short one
FrameChoice = Callable[[int], int | None]  # the frame whose mask the bad view shows; None: an empty mask


@lru_cache
def poses() -> tuple[PersonPose, ...]:
    return (*[t_pose_at(SEED)] * STANDING, *in_motion(SEED, SHORT.stop - STANDING))


@lru_cache
def masks() -> tuple[Mapping[str, Mask], ...]:
    return tuple(rendered_masks(CAMERAS, SEED, pose) for pose in poses())


def play(
    cameras: Mapping[str, Camera], shown: Callable[[int, str], Mask | None], frames: range = ALL
) -> tuple[TrackerState, list[m.Message], set[str]]:
    """Final state, all messages, and every finding.  shown: mask of a frame and viewer, or None."""
    config, state, published, findings = setup(cameras), None, list[m.Message](), set[str]()
    for frame in frames:
        masks = {viewer: shown(frame, viewer) for viewer in cameras}
        silhouettes = (
            silhouette(viewer, frame, (100 + frame) * FRAME_NS, mask) for viewer, mask in masks.items() if mask is not None
        )
        state, more = track_each(config, state, silhouettes)
        published += more
        findings |= set(state.findings)
    return state, published, findings


def with_fault(which: FrameChoice) -> Callable[[int, str], Mask | None]:
    def shown(frame: int, viewer: str) -> Mask:
        at = frame if viewer != BAD else which(frame)
        mask = masks()[frame if at is None else at][viewer]
        return np.zeros_like(mask) if at is None else mask

    return shown


def error(published: list[m.Message], last: range = ALL[-22:-2]) -> float:
    """Mean distance of the hips over the last frames, metres."""
    found = {message.frame: message for message in published if isinstance(message, m.TrackerPose) and not message.lost}
    assert all(frame in found for frame in last)
    return float(np.mean([hip_error(SEED, found[frame].position, poses()[frame]) for frame in last]))


def turned(camera: Camera) -> Camera:
    """Camera rotated by 5 degrees about its centre."""
    rotation = rx(np.radians(5.0)) @ camera.rotation
    return replace(camera, rotation=rotation, translation=-rotation @ camera.centre)


def moved(camera: Camera) -> Camera:
    """Camera moved up by 10 cm, same direction."""
    return replace(camera, translation=-camera.rotation @ (camera.centre + np.array([0.0, 0.1, 0.0])))


@pytest.mark.nightly
def test_consistent_views_give_no_finding() -> None:
    state, published, findings = play(CAMERAS, with_fault(lambda frame: frame))
    assert not findings
    assert state.used == tuple(CAMERAS)
    assert tracker.describe(state) == "tracking"
    assert error(published) < 0.05


@pytest.mark.nightly
@pytest.mark.parametrize("fault", [turned, moved])
def test_wrong_calibration_is_reported_and_excluded(fault: Callable[[Camera], Camera]) -> None:
    wrong = {viewer: fault(camera) if viewer == BAD else camera for viewer, camera in CAMERAS.items()}
    state, published, findings = play(wrong, with_fault(lambda frame: frame))
    assert any(f"view {BAD} disagrees" in text and "%" in text for text in findings), findings
    assert f"view {BAD}" in tracker.describe(state)
    assert BAD not in state.used
    assert error(published) < 0.05


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("which", "frames", "words", "last", "limit_m"),
    [
        (lambda frame: None if frame > 90 else frame, ALL, "is empty for", 20, 0.05),
        (lambda frame: min(frame, 80), ALL, "is frozen", 20, 0.05),
        (lambda frame: frame - 2, SHORT, "is out of step, 2 frames late", 20, 0.06),
        (lambda frame: frame - 4, SHORT, "is out of step, 4 frames late", 20, 0.06),
    ],
    ids=["empty", "frozen", "two late", "four late"],
)
def test_faulty_view_is_reported_and_the_person_tracked_with_the_others(
    which: FrameChoice, frames: range, words: str, last: int, limit_m: float
) -> None:
    state, published, findings = play(CAMERAS, with_fault(which), frames)
    assert any(f"view {BAD} {words}" in text for text in findings), findings
    assert BAD not in state.used or words != "is frozen"
    assert tracker.describe(state).startswith("tracking")
    assert error(published, frames[-last - 2 : -2]) < limit_m


@pytest.mark.nightly
def test_mask_of_another_size_is_counted_and_excluded() -> None:
    small = np.ones((20, 30), np.uint8)
    state, published, _ = play(CAMERAS, lambda frame, viewer: small if viewer == BAD else masks()[frame][viewer])
    assert tracker.counts(state)["damaged"] == len(ALL)
    assert state.used == tuple(viewer for viewer in CAMERAS if viewer != BAD)
    _, without, _ = play(CAMERAS, lambda frame, viewer: None if viewer == BAD else masks()[frame][viewer])
    found, expected = ({one.frame: one for one in some if isinstance(one, m.TrackerPose)} for some in (published, without))
    assert len(expected) >= len(found) - 2 > 0  # a frame set without one view is complete when the next one begins
    assert all(found[frame] == pose for frame, pose in expected.items())
