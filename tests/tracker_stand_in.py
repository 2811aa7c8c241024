"""A tracking core of the same signature that does no work: it finds a fixed pose in whatever it is shown."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np
from actor_cameras import look

from common.actor.person import person
from common.actor.truth import true_bdp
from common.body.anatomy import TEN_PARTS
from common.body.definition import neutral_pose
from common.camera.pinhole import Camera
from services.tracker.tracking import Mask, Options, Outcome, Setup

SIZE = (160, 120)
FRAME_NS = 1_000_000_000 // 15
BDP = true_bdp(person(3))
POSE = neutral_pose(TEN_PARTS, np.array([0.1, 0.95, -0.2]), yaw=0.3)
POINTS = np.array([[0.1, 1.2, -0.3], [0.0, 0.4, 0.25]])
SPREAD = np.linspace(0.01, 0.02, len(TEN_PARTS.angles) + 3)


def cameras(count: int) -> dict[str, Camera]:
    """On a ring around the origin, 5.2 m away, by viewer "1", "2" ..."""
    turns = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    middle = np.array([0.0, 1.0, 0.0])
    centres = [np.array([5.2 * np.sin(turn), 1.0, 5.2 * np.cos(turn)]) for turn in turns]
    return {str(k): look(f"cam{k}", at, middle).resized(SIZE) for k, at in enumerate(centres, start=1)}


def tracker_setup(count: int = 3) -> Setup:
    return Setup(TEN_PARTS, cameras(count), FRAME_NS, None, Options())


@dataclass(frozen=True)
class Followed:
    """seen: capture time of every instant, with the views that were shown, those with a person only."""

    seen: tuple[tuple[int, tuple[str, ...]], ...] = ()


def initial_state(setup: Setup) -> Followed:
    return Followed()


def follow(setup: Setup, state: Followed, captured_ns: int, masks: Mapping[str, Mask]) -> tuple[Followed, Outcome]:
    """Measures the body in the first instant with a person; loses the person when all views are empty."""
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


def describe(state: Followed) -> str:
    return "tracking" if state.seen and state.seen[-1][1] else "waiting for a person"


@contextmanager
def stand_in() -> Iterator[None]:
    """The tracker's step uses this core."""
    core = "services.tracker.tracking"
    with (
        patch(f"{core}.follow", follow),
        patch(f"{core}.initial_state", initial_state),
        patch(f"{core}.describe", describe),
    ):
        yield
