"""Bad input through the tracker's step: findings, tracking with the other views."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support.built_messages import camera_message
from tests.support.tracker_ring import FRAME_NS, rendered_masks, ring, setup, simulated_person, t_pose_at
from tests.support.two_view_run import envelope
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.bus.protocol import Tick
from zenocap.common.camera.pinhole import Camera
from zenocap.common.vision.mask_codec import pack
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import State
from zenocap.simulation.body.pose import PersonPose, neutral
from zenocap.simulation.body.rotation import rx
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import motion_timeline

pytestmark = pytest.mark.slow

SEED, VIEWS, STANDING = 12, 5, 70
CAMERAS = ring(VIEWS)
BAD = "2"
ALL, SHORT = range(140), range(64, 174)  # frames: with a long T-pose, and with a short one
FrameChoice = Callable[[int], int | None]  # the frame whose mask the bad view shows; None: an empty mask


@lru_cache
def poses() -> tuple[PersonPose, ...]:
    walking = motion_timeline(simulated_person(SEED), "walking", 0)
    moving = [walking.pose_at(walking.motion_from_s + k / 30) for k in range(SHORT.stop - STANDING)]
    return (*[t_pose_at(SEED)] * STANDING, *[pose or neutral(simulated_person(SEED)) for pose in moving])


@lru_cache
def masks() -> tuple[Mapping[str, Mask], ...]:
    return tuple(rendered_masks(CAMERAS, SEED, pose) for pose in poses())


def silhouette(viewer: str, frame: int, mask: Mask) -> m.Silhouette:
    region, data = pack(mask)
    size = (mask.shape[1], mask.shape[0])
    return m.Silhouette(
        frame=frame, captured_ns=(100 + frame) * FRAME_NS, viewer=viewer, size=size, region=region, data=data
    )


def play(
    cameras: Mapping[str, Camera], shown: Callable[[int, str], Mask | None], frames: range = ALL
) -> tuple[State, list[m.Message], set[str]]:
    """Final state, all messages, and every finding.  shown: mask of a frame and viewer, or None."""
    config = setup(cameras)
    state, published, findings = tracker.initial_state(config), list[m.Message](), set[str]()
    for frame in frames:
        for viewer in cameras:
            mask = shown(frame, viewer)
            if mask is None:
                continue
            state, more = tracker.step(config, state, envelope(silhouette(viewer, frame, mask)))
            published += more
            while tracker.pending(state):
                state, more = tracker.step(config, state, Tick(0))
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
    hips = {frame: truth(simulated_person(SEED), poses()[frame]).joints["Hip"] for frame in last}
    return float(np.mean([np.linalg.norm(np.array(found[frame].position) - hips[frame]) for frame in last]))


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
def test_empty_view_is_reported() -> None:
    state, published, findings = play(CAMERAS, with_fault(lambda frame: None if frame > 90 else frame))
    assert any(f"view {BAD} is empty for" in text for text in findings)
    assert error(published) < 0.05
    assert tracker.describe(state).startswith("tracking")


@pytest.mark.nightly
def test_frozen_view_is_reported_and_excluded() -> None:
    state, published, findings = play(CAMERAS, with_fault(lambda frame: min(frame, 80)))
    assert any(f"view {BAD} is frozen" in text for text in findings)
    assert BAD not in state.used
    assert error(published, ALL[-8:-2]) < 0.06  # meanwhile the person may have been lost


@pytest.mark.nightly
@pytest.mark.parametrize("late", [2, 4])
def test_view_out_of_step_is_reported_with_its_lag(late: int) -> None:
    _, published, findings = play(CAMERAS, with_fault(lambda frame: frame - late), SHORT)
    assert any(f"view {BAD} is out of step, {late} frames late" in text for text in findings), findings
    assert error(published, SHORT[-22:-2]) < 0.06


@pytest.mark.nightly
def test_single_view_waits_for_a_second() -> None:
    state, published, _ = play(CAMERAS, lambda frame, viewer: masks()[frame][viewer] if viewer == "1" else None)
    assert not published
    assert tracker.describe(state) in (
        "waiting for silhouettes",
        "waiting for a second view; viewer 2 and 3 and 4 and 5 missing",
    )


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


def test_viewer_with_another_calibration_is_reported_with_real_views() -> None:
    camera = moved(CAMERAS[BAD])
    info = camera_message(camera, viewer=BAD)
    state, _ = tracker.step(setup(CAMERAS), tracker.initial_state(setup(CAMERAS)), envelope(info))
    assert list(state.calibrations) == [BAD]
