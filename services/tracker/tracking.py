"""One person followed through instants of silhouettes: the interface that the tracker's step is written against."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.camera.pinhole import Camera
from services.tracker.prior.model import Prior

Mask = NDArray[np.uint8]
Method = Literal["hybrid", "image-force", "particle-filter"]
Refinement = Literal["gauss-newton", "force", "force-printed"]


@dataclass(frozen=True)
class Options:
    """points: of the visual hull.  iterations: of the refinement.  seed: of everything that is drawn."""

    method: Method = "hybrid"
    particles: int = 40
    points: int = 400
    iterations: int = 4
    seed: int = 0
    refinement: Refinement = "gauss-newton"


@dataclass(frozen=True)
class Setup:
    """cameras: by viewer, at the working size, in the rig's order.  frame_ns: frame period.  person_height: metres."""

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    prior: Prior | None
    options: Options
    person_height: float | None = None


@dataclass(frozen=True)
class TrackState:
    """What is known of the person."""


@dataclass(frozen=True)
class Outcome:
    """body: when it was newly measured.  pose: None while there is none.  views: those that were used.

    spread: (angles + 3,) standard deviations over the particles, radians, then the position's, metres.
    """

    body: Bdp | None
    pose: Pose | None
    spread: Floats
    likelihood: float
    effective: float
    lost: bool
    views: tuple[str, ...]
    findings: tuple[str, ...] = ()


def initial_state(setup: Setup) -> TrackState:
    return TrackState()


def follow(setup: Setup, state: TrackState, captured_ns: int, masks: Mapping[str, Mask]) -> tuple[TrackState, Outcome]:
    """masks: by viewer, (height, width) not 0 on the person; of two or more views."""
    nothing = np.zeros(len(setup.anatomy.angles) + 3)
    return state, Outcome(None, None, nothing, 0.0, 0.0, False, tuple(masks))


def describe(state: TrackState) -> str:
    """What is being done, for people."""
    return "waiting for a person"
