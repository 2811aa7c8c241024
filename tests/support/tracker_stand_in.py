"""Stand-in for the tracking core, of the same signature: a fixed pose for any input."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Mask
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import neutral_pose
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Phase
from zenocap.services.tracker.states import Options, Outcome, TrackerSetup
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp

SIZE = (160, 120)
FRAME_NS = 1_000_000_000 // 15
BDP = true_bdp(person(4))
POSE = neutral_pose(TEN_PARTS, np.array([0.1, 0.95, -0.2]), yaw=0.3)
POINTS = np.array([[0.1, 1.2, -0.3], [0.0, 0.4, 0.25]])
SPREAD = np.linspace(0.01, 0.02, len(TEN_PARTS.angles) + 3)


def cameras(count: int) -> dict[str, Camera]:
    """On a ring around the origin, 5.2 m away, by viewer "1", "2" ..."""
    turns = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    middle = np.array([0.0, 1.0, 0.0])
    centres = [np.array([5.2 * np.sin(turn), 1.0, 5.2 * np.cos(turn)]) for turn in turns]
    return {str(k): look(f"cam{k}", at, middle).resized(SIZE) for k, at in enumerate(centres, start=1)}


def tracker_setup(count: int = 3) -> TrackerSetup:
    return TrackerSetup(TEN_PARTS, cameras(count), FRAME_NS, None, Options())


@dataclass(frozen=True)
class StandInTrack:
    """seen: capture time of every frame set, with the views that have a person.  corrected: number of corrected times.

    phase: none that awaits a person.
    """

    seen: tuple[tuple[int, tuple[str, ...]], ...] = ()
    corrected: int = 0
    phase: None = None


def initial_state(setup: TrackerSetup) -> StandInTrack:
    return StandInTrack()


def track(
    setup: TrackerSetup, state: StandInTrack, captured_ns: int, masks: Mapping[str, Mask]
) -> tuple[StandInTrack, Outcome]:
    """Measures the body in the first frame set with a person; loses the person when all views are empty."""
    views = tuple(viewer for viewer, mask in masks.items() if mask.any())
    if any(mask.all() for mask in masks.values()):
        raise ValueError("a view that is all person")
    first = bool(views) and not any(shown for _, shown in state.seen)
    findings = tuple(f"view {viewer} is empty" for viewer in masks if viewer not in views) if views else ()
    outcome = Outcome(
        body=BDP if first else None, pose=POSE if views else None, spread=SPREAD, likelihood=-0.5, effective=20.0,
        lost=not views, views=views, findings=findings, points=POINTS,
    )  # fmt: skip
    return replace(state, seen=(*state.seen, (captured_ns, views))), outcome


def with_other_times(state: StandInTrack) -> StandInTrack:
    return replace(state, corrected=state.corrected + 1)


def describe(state: StandInTrack) -> str:
    return "tracking" if state.seen and state.seen[-1][1] else "waiting for a person"


def phase_of(state: StandInTrack) -> Phase:
    return Phase.TRACKING if state.seen and state.seen[-1][1] else Phase.AWAITING_PERSON


@contextmanager
def stand_in() -> Iterator[None]:
    """Replace the core of the tracker's step within the context."""
    core = "zenocap.services.tracker.tracking"
    with (
        patch(f"{core}.track", track),
        patch(f"{core}.initial_state", initial_state),
        patch(f"{core}.remeasure", initial_state),
        patch(f"{core}.with_other_times", with_other_times),
        patch(f"{core}.describe", describe),
        patch(f"{core}.phase_of", phase_of),
    ):
        yield
