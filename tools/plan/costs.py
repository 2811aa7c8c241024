"""Costs of one frame, frame set, message and process, and their file."""

from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError


@dataclass(frozen=True)
class Linear:
    """A cost of the form base + each * x."""

    base: float
    each: float

    def at(self, x: float) -> float:
        return self.base + self.each * x


@dataclass(frozen=True)
class Costs:
    """Processor time in milliseconds of one core, sizes in bytes, memory in megabytes.

    silhouette, two_view: of a viewer for one frame, by megapixels, without its source.  decoding: of a frame, by the same.
    integrator: of a frame set, two-view.  tracker: of a frame set, by views.  timekeeper: of the integrator of a rig with a
    tracker, per second.  logged, logged_foxglove: of one message in the log.  forwarded: of one message through a router.
    animator: per frame set; page: of one page per second.  process: of any process per second.
    silhouette_bytes: by the square root of the megapixels.  preview_bytes: the same.  sighting_bytes, bap_bytes,
    assignment_bytes, pose_bytes, tracker_pose_bytes, points_bytes, health_bytes, trace_bytes: of one message.
    overhead_bytes: of Zenoh and TCP/IP for one message.  stored: size on the disk of one byte; foxglove_size: factor of it.
    viewer_mb, integrator_mb, tracker_mb, animator_mb, router_mb: memory of a process.
    """

    silhouette: Linear
    two_view: Linear
    decoding: Linear
    integrator: float
    tracker: Linear
    timekeeper: float
    logged: float
    logged_foxglove: float
    forwarded: float
    animator: float
    page: float
    process: float
    silhouette_bytes: Linear
    preview_bytes: Linear
    sighting_bytes: float
    bap_bytes: float
    assignment_bytes: float
    pose_bytes: float
    tracker_pose_bytes: float
    points_bytes: float
    health_bytes: float
    trace_bytes: float
    overhead_bytes: float
    stored: float
    foxglove_size: float
    viewer_mb: float
    integrator_mb: float
    tracker_mb: float
    animator_mb: float
    router_mb: float


def write_costs(path: Path, costs: Costs) -> None:
    """Write the costs as JSON.  Raises OSError."""
    write_atomically(path, msgspec.json.format(msgspec.json.encode(asdict(costs)), indent=1))


def read_costs(path: Path) -> Costs:
    """Costs that `zenocap plan --measure` has written.  Raises UserError and OSError."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Costs)
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(f"{path}: no file of `zenocap plan --measure`: {error}") from error
