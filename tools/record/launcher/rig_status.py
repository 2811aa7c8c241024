"""Status of a rig from its messages, for the live table and the plain lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import degrees
from types import MappingProxyType

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope, Received
from zenocap.common.observe.view import RigView, observed
from zenocap.common.runtime.foreign_text import printable

MAX_POSTURES = 256  # labels that are counted, as many as a model may have

# Joint angles that are easy to recognize, as the page shows them, and their signs: a knee bends about -X.
SHOWN_ANGLES = (
    ("turn", "navel.y", 1), ("right elbow", "right_elbow.x", 1), ("left elbow", "left_elbow.x", 1),
    ("right knee", "right_knee.x", -1), ("left knee", "left_knee.x", -1),
)  # fmt: skip


@dataclass(frozen=True)
class RigStatus:
    """services: presence and health.  pose: last one of the tracker, or universal BAP without any.  poses: their number.
    complete: number of those to which every viewer contributes.  posture, postures: last one; number by label."""

    services: RigView
    pose: m.UniversalBap | m.TrackerPose | None = None
    poses: int = 0
    complete: int = 0
    posture: m.Posture | None = None
    postures: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def updated(self, event: Received, at_ns: int) -> "RigStatus":
        """The status after one event.  at_ns: see `zenocap.common.observe.view`."""
        match event:
            case Envelope(message=m.UniversalBap()) if isinstance(self.pose, m.TrackerPose):
                return self  # of a rig with both methods
            case Envelope(message=m.UniversalBap() as bap):
                return replace(self, pose=bap, poses=self.poses + 1, complete=self.complete + (not bap.stale))
            case Envelope(message=m.TrackerPose() as pose):
                viewers = {id for service, id in self.services.alive if service == "viewer"}
                return replace(self, pose=pose, poses=self.poses + 1, complete=self.complete + (viewers <= {*pose.views}))
            case Envelope(message=m.Posture() as posture):
                label = posture_label(posture)
                if label not in self.postures and len(self.postures) >= MAX_POSTURES:
                    label = "others"
                postures = {**self.postures, label: self.postures.get(label, 0) + 1}
                return replace(self, posture=posture, postures=MappingProxyType(postures))
            case _:
                services = observed(self.services, event, at_ns)
                return self if services is self.services else replace(self, services=services)

    def angles(self) -> dict[str, int]:
        """The displayed joint angles of the last pose, integer degrees: 0 of a straight elbow or knee, above 0 bent."""
        if self.pose is None:
            return {}
        named = self.pose.angles
        return {label: round(sign * degrees(named[name])) for label, name, sign in SHOWN_ANGLES if name in named}


def view_of(pose: m.UniversalBap | m.TrackerPose | None, viewer: str) -> tuple[str, float | None]:
    """Role of a viewer in a pose ("" for none), and its matching score, None without one."""
    match pose:
        case m.UniversalBap(views=views, scores=scores) if viewer in views:
            return views[viewer], scores.get(viewer)
        case m.TrackerPose(views=used):
            return "used" if viewer in used else "left out", None
        case _:
            return "", None


def posture_label(posture: m.Posture) -> str:
    return printable(posture.label or "unknown movement")


def lost_text(pose: m.UniversalBap | m.TrackerPose) -> str:
    """Limbs that are being relocalized, and viewers whose contribution is old; empty when there are none."""
    if isinstance(pose, m.TrackerPose):
        limbs = " and ".join(limb.replace("_", " ") for limb in pose.lost_limbs)
        return "searching for the person" if pose.lost else f"{limbs} uncertain" if limbs else ""
    parts = []
    if pose.lost:
        parts.append("searching for " + ", ".join(name.replace("_", " ") for name in pose.lost))
    if pose.stale:
        parts.append("without viewer " + " and ".join(pose.stale))
    return "; ".join(parts)
