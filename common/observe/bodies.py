"""Bodies of a rig's methods with their poses, as arrays.  Pure: steps and readers keep the `Bodies`."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, TypeAlias

from zenocap.common import messages as m
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.conversion import Bap, anatomy_of, bdp_of, lost_parts, pose_of

Source = Literal["two-view", "tracker"]  # estimator of a pose


@dataclass(frozen=True)
class SourceBody:
    """Body of a source."""

    anatomy: Anatomy
    bdp: Bdp


Bodies: TypeAlias = Mapping[Source, SourceBody]
NO_BODIES: Bodies = MappingProxyType({})


@dataclass(frozen=True)
class Posed:
    """Pose of a person with the body of its source.  message: the pose as it was published."""

    source: Source
    anatomy: Anatomy
    body: Bdp
    pose: Pose
    message: Bap

    @property
    def lost(self) -> tuple[str, ...]:
        """Limbs, or "person", that are being searched for; position and angles are then the last known ones."""
        return tuple(lost_parts(self.message))


def source_of(message: m.Message) -> Source | None:
    """The source that publishes a body or a pose; None for other messages."""
    match message:
        case m.UniversalBdp() | m.UniversalBap():
            return "two-view"
        case m.TrackerBdp() | m.TrackerPose():
            return "tracker"
        case _:
            return None


def posed(bodies: Bodies, message: m.Message) -> tuple[Bodies, Posed | None]:
    """The bodies after a message, and its pose; None for a pose whose body is not known yet, and for other messages.

    Raises ValueError for a body of an unknown anatomy and for a pose of another anatomy than its body's.
    """
    source = source_of(message)
    match message:
        case m.UniversalBdp(body=body) | m.TrackerBdp(body=body) if source is not None:
            anatomy = anatomy_of(body)
            return {**bodies, source: SourceBody(anatomy, bdp_of(anatomy, body))}, None
        case m.UniversalBap() | m.TrackerPose() if source is not None and source in bodies:
            one = bodies[source]
            return bodies, Posed(source, one.anatomy, one.bdp, pose_of(one.anatomy, message), message)
        case _:
            return bodies, None
