"""Presence of the rig's services on the page: the view of the rig, and the last frame of each viewer.

Times are of the reader's monotonic clock.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.messages import PartialBap, Sighting, Silhouette
from zenocap.common.observe import view as rig_view
from zenocap.common.observe.view import RigView, Status
from zenocap.common.rig.services import ServiceKey
from zenocap.services.animator.parameters import FRAME_TIMEOUT_NS

Condition = Literal["ok", "starting", "stale", "gone"]
CONDITIONS: Mapping[Status, Condition] = {
    "up": "ok", "starting": "starting", "missing": "starting", "silent": "stale", "gone": "gone",
}  # fmt: skip


@dataclass(frozen=True)
class Presence:
    """frames: time of the last message of each viewer that it sends with every frame, ns."""

    view: RigView
    frames: Mapping[str, int] = field(default_factory=dict)

    @property
    def services(self) -> Sequence[ServiceKey]:
        """The expected services in the order of the rig, then the others as they came."""
        return tuple(dict.fromkeys((*self.view.expected, *self.view.services)))


def observed(presence: Presence, event: Envelope | Alive, at_ns: int) -> Presence:
    """Presence after an event that was received at a time."""
    view = rig_view.observed(presence.view, event, at_ns)
    frames = presence.frames
    match event:
        case Alive(service="viewer", id=viewer):  # it has ended, or has to learn its background again
            frames = {id: ns for id, ns in frames.items() if id != viewer}
        case Envelope(message=Sighting(viewer=viewer) | Silhouette(viewer=viewer) | PartialBap(viewer=viewer)):
            if ("viewer", viewer) in view.services or ("viewer", viewer) in view.expected:
                frames = {**frames, viewer: at_ns}
    return presence if view is presence.view and frames is presence.frames else Presence(view, frames)


def condition(presence: Presence, service: ServiceKey, now_ns: int) -> Condition:
    """Condition of a service: "stale" when it publishes nothing, or a viewer no frames."""
    status = rig_view.status(presence.view, service, now_ns)
    frame_ns, known = _frame_ns(presence, service), presence.view.services.get(service)
    if frame_ns is not None:
        return "ok" if now_ns - frame_ns <= FRAME_TIMEOUT_NS else "gone" if status == "gone" else "stale"
    if status == "silent" and known is not None and known.health is None:
        return "starting"  # a first step that is compiled takes a minute
    return CONDITIONS[status]


def silent_ns(presence: Presence, service: ServiceKey, now_ns: int) -> int:
    """Time since the last frame of a viewer, or the last health of another service; 0 before the first."""
    known = presence.view.services.get(service)
    last_ns = _frame_ns(presence, service) or (known.health_ns if known is not None else 0)
    return now_ns - last_ns if last_ns else 0


def troubled(presence: Presence, now_ns: int) -> Sequence[str]:
    """Names of the services that are stale or gone."""
    found = [service for service in presence.services if condition(presence, service, now_ns) in ("stale", "gone")]
    return [f"{name} {id}" for name, id in found]


def _frame_ns(presence: Presence, service: ServiceKey) -> int | None:
    return presence.frames.get(service[1]) if service[0] == "viewer" else None
