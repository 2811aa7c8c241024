"""What the animator shows and sends on: the actor of one instant, and everything known of the rig beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from common import messages as m
from common.body.anatomy import Anatomy
from common.body.definition import Bdp, Pose
from common.camera.pinhole import Camera

Source = Literal["two-view", "tracker"]
Condition = Literal["well", "starting", "stale", "gone"]


@dataclass(frozen=True)
class Actor:
    """The virtual actor of one instant.

    captured_ns: of the instant, on the integrator's clock.  received_ns: when it came here, this machine's clock.
    lost: limbs, or "person", that are being searched for; position and angles are then the last ones known.
    """

    frame: int
    captured_ns: int
    received_ns: int
    source: Source
    anatomy: Anatomy
    body: Bdp
    pose: Pose
    lost: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """One service of the rig.  condition: "stale" when it is there and silent.  silent_ns: since its last message."""

    service: str
    id: str
    condition: Condition
    silent_ns: int
    health: m.Health | None


@dataclass(frozen=True)
class Snapshot:
    """Everything known at `now_ns`, this machine's clock.  actors: by who found them.  The others: by viewer."""

    now_ns: int
    actors: Mapping[Source, Actor]
    rows: Sequence[Row]
    silhouettes: Mapping[str, m.Silhouette]
    sightings: Mapping[str, m.Sighting]
    previews: Mapping[str, m.Preview]
    cameras: Mapping[str, Camera]
    assignment: m.Assignment | None
    posture: m.Posture | None = None
