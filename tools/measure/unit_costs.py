"""Costs of one frame, frame set, message and process: their file, and those of a small server.

Provenance: pages of docs up to November 2026, measured on two cores of a small server.  `zenocap plan --measure` scales the
costs of viewers, integrator, tracker and router to the user's machine.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError

USABLE = 0.6  # share of all cores; load page: loads are held up to 0.8 to 1.3 of two cores, processes then wait for one
LOOP_USABLE = 0.85  # of the time of a service's loop, which is one thread, or of its core; by hand


@dataclass(frozen=True)
class Linear:
    """A cost of the form base + each * x."""

    base: float
    each: float

    def at(self, x: float) -> float:
        return self.base + self.each * x


@dataclass(frozen=True)
class Costs:
    """Processor time in milliseconds of one core, sizes in bytes of one message, memory in megabytes of one process."""

    silhouette: Linear  # of a viewer for one frame, by megapixels, without its source
    two_view: Linear  # the same
    decoding: Linear  # of a frame, by megapixels
    integrator: float  # of a frame set, two-view
    tracker: Linear  # of a frame set, by views
    timekeeper: float  # of the integrator of a rig with a tracker, per second
    logged: float  # of one message in the log
    logged_foxglove: float
    forwarded: float  # of one message through a router
    animator: float  # of a frame set
    page: float  # of one page per second
    process: float  # of any process per second
    silhouette_bytes: Linear  # by the square root of the megapixels
    preview_bytes: Linear  # the same
    sighting_bytes: float
    bap_bytes: float
    assignment_bytes: float
    pose_bytes: float
    tracker_pose_bytes: float
    points_bytes: float
    health_bytes: float
    trace_bytes: float
    overhead_bytes: float  # of Zenoh and TCP/IP
    stored: float  # size on the disk of one byte
    foxglove_size: float  # factor of it
    viewer_mb: float
    integrator_mb: float
    tracker_mb: float
    animator_mb: float
    router_mb: float


COSTS = Costs(
    # `zenocap load --method hybrid --rate 30`: 0.04 cores of a viewer at 160 x 120, 0.10 at 640 x 480, 0.26 at 1280 x 720.
    silhouette=Linear(0.9, 7.0),
    # load page, frame rate reached: 0.26 cores at 160 x 120 and 60/s, 0.25 at 640 x 480 and 30/s.
    two_view=Linear(4.0, 14.0),
    decoding=Linear(0.05, 0.8),  # docs/measured.md at commit 8523d15f: 0.3 ms at 640 x 480
    integrator=2.5,  # load page: 0.16 cores at 60/s
    # `zenocap load --method hybrid --rate 30`: 0.50, 0.55, 0.63 cores with 2, 4 and 7 views, both threads; 18 ms of four
    # views at 8, 15 and 30/s, 14 ms at 60/s.  Longer than where it never waits.
    tracker=Linear(14.8, 0.85),
    timekeeper=5.0,  # of a second; `zenocap load --method hybrid`: 0.01 cores of the integrator without a log
    logged=0.043,  # docs/measured.md at commit ebbdaf21: the log's thread, 1720 messages/s: 7.4 % of a core,
    logged_foxglove=0.1,  # and 17 % with Foxglove channels
    forwarded=0.05,  # `zenocap load --rigs 16`: 0.08 cores of the router for about 1400 messages/s
    animator=5.0,  # page of the animator: 27 % of a core without a page at 60/s, less the health of the process
    page=30.0,  # of a second; page of the animator: 27 % without and 30 % with a page, 39 % with four
    process=8.0,  # of a second, for health, clock and Zenoh; by hand: fits 32 viewers whose frames are mostly left out
    # Means of a take of the demo at 160 x 120; its silhouettes in other sizes; a pose of 14 parts, 400 points.
    silhouette_bytes=Linear(125.0, 300.0),
    preview_bytes=Linear(3_000.0, 4_000.0),  # JPEG of at most 320 px; by hand
    sighting_bytes=573.0,
    bap_bytes=739.0,
    assignment_bytes=260.0,
    pose_bytes=634.0,
    tracker_pose_bytes=2_590.0,
    points_bytes=2_466.0,
    health_bytes=700.0,
    trace_bytes=100.0,
    overhead_bytes=90.0,  # Zenoh's frame and key, TCP and IP headers of a message that is sent alone
    stored=0.66,  # size of a take of the demo over that of its messages
    foxglove_size=1.6,  # of a take with Foxglove channels relative to one without; by hand
    viewer_mb=115.0,  # load page, soak test
    integrator_mb=100.0,
    tracker_mb=175.0,  # docs/machines.md at commit e72cdbe6: 80 to 175 MB
    animator_mb=220.0,  # page of the animator
    router_mb=40.0,
)


def write_costs(path: Path, costs: Costs) -> None:
    """Write the costs as JSON.  Raises OSError."""
    write_atomically(path, msgspec.json.format(msgspec.json.encode(asdict(costs)), indent=1))


def read_costs(path: Path) -> Costs:
    """Costs that `zenocap plan --measure` has written.  Raises UserError and OSError."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Costs)
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(f"{path}: no file of `zenocap plan --measure`: {error}") from error
