"""Bad input through the tracker's step with the real core: what is told, and that tracking goes on with the rest."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from tracker_ring import FRAME_NS, Mask, initial, ring, seen, setup, someone
from two_view_run import envelope

from common import messages as m
from common.actor.pose import ActorPose, neutral
from common.actor.rotation import rx
from common.actor.script import motion_script
from common.actor.truth import truth
from common.bus.protocol import Tick
from common.camera.pinhole import Camera
from common.vision.packing import pack
from services.tracker import step as tracker
from services.tracker.states import State

SEED, VIEWS, STANDING = 3, 5, 70
CAMERAS = ring(VIEWS)
BAD = "2"
ALL, SOON = range(140), range(64, 174)  # frames: with a long initial posture, and with a short one
Spoil = Callable[[int], int | None]  # which frame's mask the bad view shows in a frame; None for an empty one


@lru_cache
def poses() -> tuple[ActorPose, ...]:
    walking = motion_script(someone(SEED), "walking", 0)
    moving = [walking.pose_at(walking.motion_from_s + k / 30) for k in range(SOON.stop - STANDING)]
    return (*[initial(SEED)] * STANDING, *[pose or neutral(someone(SEED)) for pose in moving])


@lru_cache
def masks() -> tuple[Mapping[str, Mask], ...]:
    return tuple(seen(CAMERAS, SEED, pose) for pose in poses())


def silhouette(viewer: str, frame: int, mask: Mask) -> m.Silhouette:
    region, data = pack(mask)
    size = (mask.shape[1], mask.shape[0])
    return m.Silhouette(
        frame=frame, captured_ns=(100 + frame) * FRAME_NS, viewer=viewer, size=size, region=region, data=data
    )


def play(
    cameras: Mapping[str, Camera], shown: Callable[[int, str], Mask | None], frames: range = ALL
) -> tuple[State, list[m.Message], set[str]]:
    """The state at the end, all messages, and every finding on the way.  shown: the mask of a frame and viewer, or none."""
    the = setup(cameras)
    state, said, findings = tracker.initial_state(the), list[m.Message](), set[str]()
    for frame in frames:
        for viewer in cameras:
            mask = shown(frame, viewer)
            if mask is None:
                continue
            state, more = tracker.step(the, state, envelope(silhouette(viewer, frame, mask)))
            said += more
            while tracker.pending(state):
                state, more = tracker.step(the, state, Tick(0))
                said += more
        findings |= set(state.findings)
    return state, said, findings


def spoilt(which: Spoil) -> Callable[[int, str], Mask | None]:
    def shown(frame: int, viewer: str) -> Mask:
        at = frame if viewer != BAD else which(frame)
        mask = masks()[frame if at is None else at][viewer]
        return np.zeros_like(mask) if at is None else mask

    return shown


def error(said: list[m.Message], last: range = ALL[-22:-2]) -> float:
    """Mean distance of the hips over the last frames, metres."""
    found = {message.frame: message for message in said if isinstance(message, m.TrackerPose) and not message.lost}
    assert all(frame in found for frame in last)
    hips = {frame: truth(someone(SEED), poses()[frame]).joints["Hip"] for frame in last}
    return float(np.mean([np.linalg.norm(np.array(found[frame].position) - hips[frame]) for frame in last]))


def turned(camera: Camera) -> Camera:
    """By 5 degrees, in its place."""
    rotation = rx(np.radians(5.0)) @ camera.rotation
    return replace(camera, rotation=rotation, translation=-rotation @ camera.centre)


def moved(camera: Camera) -> Camera:
    """Up by 10 cm, looking the same way."""
    return replace(camera, translation=-camera.rotation @ (camera.centre + np.array([0.0, 0.1, 0.0])))


def test_with_all_views_right_nothing_is_said() -> None:
    state, said, findings = play(CAMERAS, spoilt(lambda frame: frame))
    assert not findings
    assert state.used == tuple(CAMERAS)
    assert tracker.describe(state) == "tracking"
    assert error(said) < 0.05


@pytest.mark.parametrize("fault", [turned, moved])
def test_a_wrong_calibration_is_named_and_left_out(fault: Callable[[Camera], Camera]) -> None:
    wrong = {viewer: fault(camera) if viewer == BAD else camera for viewer, camera in CAMERAS.items()}
    state, said, findings = play(wrong, spoilt(lambda frame: frame))
    assert any(f"view {BAD} disagrees" in text and "%" in text for text in findings), findings
    assert f"view {BAD}" in tracker.describe(state)
    assert BAD not in state.used
    assert error(said) < 0.05


def test_a_view_that_sees_nobody_is_named() -> None:
    state, said, findings = play(CAMERAS, spoilt(lambda frame: None if frame > 90 else frame))
    assert any(f"view {BAD} has seen nobody for" in text for text in findings)
    assert error(said) < 0.05
    assert tracker.describe(state).startswith("tracking")


def test_a_frozen_view_is_named_and_left_out() -> None:
    state, said, findings = play(CAMERAS, spoilt(lambda frame: min(frame, 80)))
    assert any(f"view {BAD} is frozen" in text for text in findings)
    assert BAD not in state.used
    assert error(said, ALL[-8:-2]) < 0.06  # meanwhile the person may have been lost


@pytest.mark.parametrize("late", [2, 4])
def test_a_view_out_of_step_is_named_with_its_lag(late: int) -> None:
    _, said, findings = play(CAMERAS, spoilt(lambda frame: frame - late), SOON)
    assert any(f"view {BAD} is out of step, {late} frames late" in text for text in findings), findings
    assert error(said, SOON[-22:-2]) < 0.06


def test_one_view_alone_is_waited_with() -> None:
    state, said, _ = play(CAMERAS, lambda frame, viewer: masks()[frame][viewer] if viewer == "1" else None)
    assert not said
    assert tracker.describe(state) in (
        "waiting for silhouettes",
        "waiting for a second view; viewer 2 and 3 and 4 and 5 not there",
    )


def test_a_mask_of_another_size_is_counted_and_left_out() -> None:
    small = np.ones((20, 30), np.uint8)
    state, said, _ = play(CAMERAS, lambda frame, viewer: small if viewer == BAD else masks()[frame][viewer])
    assert tracker.counts(state)["damaged"] == len(ALL)
    assert state.used == tuple(viewer for viewer in CAMERAS if viewer != BAD)
    _, without, _ = play(CAMERAS, lambda frame, viewer: None if viewer == BAD else masks()[frame][viewer])
    found, expected = ({one.frame: one for one in some if isinstance(one, m.TrackerPose)} for some in (said, without))
    assert len(expected) >= len(found) - 2 > 0  # an instant that lacks a view is known to be over by the next
    assert all(found[frame] == pose for frame, pose in expected.items())


def test_another_calibration_on_the_viewers_machine_is_told() -> None:
    camera = moved(CAMERAS[BAD])
    info = m.CameraInfo(
        frame=0, captured_ns=0, viewer=BAD, name=camera.name, size=camera.size, matrix=camera.matrix.ravel().tolist(),
        distortions=camera.distortions.tolist(), rotation=camera.rotation.ravel().tolist(),
        translation=camera.translation.tolist(),
    )  # fmt: skip
    state, _ = tracker.step(setup(CAMERAS), tracker.initial_state(setup(CAMERAS)), envelope(info))
    assert list(state.calibrations) == [BAD]
