"""What the tracker's step remembers, besides the person: who sent what, and what waits."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from common.messages import Silhouette, TrackerBdp, TrackerPose
from common.pairing import Instant, Pairs
from common.runtime.clock import Offset
from services.tracker.phases import TrackState

LEAST_VIEWS = 2
MOST_READY = 2  # instants that may wait for their turn; then the oldest is dropped


@dataclass(frozen=True)
class State:
    """track: the person.  pairs: silhouettes that wait for those of other views.  ready: instants that wait for a Tick.

    pose: the last one said.  offsets: each viewer's clock against the integrator's.  warnings: by viewer, what the person
    should know of its clock; calibrations: of its camera.  findings: views that disagreed with the others, in words.
    used: views of the last instant.  points_ns: the last one whose points were said.  counts: what was lost, by reason.
    said: the body that a tracker before this one had said, if a reader told.  anew: the body is to be measured anew.
    """

    track: TrackState
    pairs: Pairs[Silhouette]
    ready: tuple[Instant[Silhouette], ...] = ()
    pose: TrackerPose | None = None
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    warnings: Mapping[str, str] = field(default_factory=dict)
    calibrations: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    used: tuple[str, ...] = ()
    points_ns: int = 0
    counts: Mapping[str, int] = field(default_factory=dict)
    said: TrackerBdp | None = None
    anew: bool = False
