"""Live poses of a running rig: `subscribe`."""

import asyncio
import logging
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.closable import Closable
from zenocap.common.conversion import is_lost
from zenocap.common.errors import UserError
from zenocap.common.live_smoothing import LiveSmoothing, live_smoothing
from zenocap.common.messages import TrackerPose
from zenocap.common.observe.bodies import NO_BODIES, Bodies, Posed, posed, source_of
from zenocap.common.rig.rig import Rig, load_rig
from zenocap.common.rig.security import security_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP

logger = logging.getLogger(__name__)

POLL_S = 0.2  # longest wait of one receive call, after which `close` and `timeout_s` are looked at


@dataclass(frozen=True)
class LivePose:
    """One pose as it was published; units and frames as in `zenocap.Poses`.

    frame: frame number of the newest image used.
    captured_ns: capture time, nanoseconds since the Unix epoch, on the integrator's clock.
    position: (3,) of the navel, metres.
    angles: joint angles by name, radians.
    joint_centres: (joints, 3) metres, rows as `joint_names`.
    lost: whether the person is being searched for; the pose is then the last one known.
    limbs: by limb, such as `right_arm`: probability that elbow and wrist, or knee and ankle, are within 150 mm of the
    person's; empty with two-view.  heading: probability that front and back are not exchanged; None where unknown.
    """

    frame: int
    captured_ns: int
    position: Floats
    angles: Mapping[str, float]
    joint_names: tuple[str, ...]
    joint_centres: Floats
    lost: bool
    limbs: Mapping[str, float]
    heading: float | None

    def __repr__(self) -> str:
        place = ", ".join(f"{value:.2f}" for value in self.position)
        lost = ", lost" if self.lost else ""
        return f"<LivePose: frame {self.frame}, navel at ({place}) m, {len(self.joint_names)} joints{lost}>"


class Subscription(Closable):
    """The poses of a rig as they come: `for pose in subscription` or `async for pose in subscription`.

    Of a rig with both methods, those of the tracker once it has a body.

    Iteration ends when the subscription is closed, or `timeout_s` after the last pose.  Use it in a `with` statement: an
    open Zenoh session keeps the process alive.  A slow reader receives every pose, late; the queue is bounded.
    """

    def __init__(self, bus: ZenohBus, timeout_s: float | None, smoothing: LiveSmoothing | None = None) -> None:
        self._bus, self._timeout_s, self._smoothing = bus, timeout_s, smoothing
        self._bodies: Bodies = NO_BODIES
        self._closed = False
        for topic in (UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE):
            bus.subscribe(topic)

    def receive(self, timeout_s: float) -> LivePose | None:
        """Return the next pose, or None after `timeout_s` or when closed."""
        until_s = monotonic() + timeout_s
        while not self._closed and (left_s := until_s - monotonic()) > 0:
            event = self._bus.receive(min(left_s, POLL_S))
            if not isinstance(event, Envelope):
                continue
            message = event.message if self._smoothing is None else self._smoothing.message(event.message)
            try:
                self._bodies, found = posed(self._bodies, message)
            except ValueError as error:  # published by another version: its poses cannot be interpreted here
                logger.warning("body ignored: %s", error)
                other = source_of(message)
                self._bodies = {source: body for source, body in self._bodies.items() if source != other}
                continue
            if found is not None and (found.source == "tracker" or "tracker" not in self._bodies):
                return _live_pose(found)
        return None

    def __iter__(self) -> Iterator[LivePose]:
        while not self._closed:
            pose = self.receive(POLL_S if self._timeout_s is None else self._timeout_s)
            if pose is not None:
                yield pose
            elif self._timeout_s is not None:
                return

    async def __aiter__(self) -> AsyncIterator[LivePose]:
        poses = iter(self)
        while (pose := await asyncio.to_thread(next, poses, None)) is not None:
            yield pose

    def close(self) -> None:
        self._closed = True
        self._bus.close()


def subscribe(
    rig: Rig | Path | str,
    *,
    connect: Sequence[str] = (),
    timeout_s: float | None = None,
    smooth: str = "off",
    smooth_hz: float | None = None,
    smooth_beta: float | None = None,
) -> Subscription:
    """Open a subscription to the poses of a running rig.

    rig: a rig or its file, whose `[zenoh]` and `[security]` tables are used, or the name of an unsecured rig, which is
        found by multicast.
    connect: Zenoh endpoints to connect to, such as "tcp/192.168.1.10:7447", instead of the rig's own.
    timeout_s: iteration ends so long after the last pose; None: it goes on until closed.
    smooth: "off", or "one-euro" to smooth the poses here; `docs/outputs.md` states the delay.
    smooth_hz, smooth_beta: of the One Euro filter: cut-off frequency at rest (Hz), and its rise per m/s or rad/s (Hz);
        None: 2 and 4.

    Poses are received once the rig has measured the body, also when this starts later.  Raises UserError when the rig
    file is wrong or Zenoh cannot be opened.
    """
    smoothing = live_smoothing(smooth, smooth_hz, smooth_beta)
    if isinstance(rig, str) and not rig.endswith(".toml") and not Path(rig).exists():
        options, name = ZenohOptions(connect=tuple(connect), multicast_scouting=not connect), rig
    else:
        one = rig if isinstance(rig, Rig) else load_rig(rig, files=False)
        table, name = one.zenoh, one.name
        try:
            security = security_of([one], "reader")
        except ValueError as error:
            raise UserError(str(error)) from error
        options = ZenohOptions(
            mode="client" if table.mode == "client" else "peer",
            connect=tuple(connect or table.connect),
            config_file=one.base / table.config if table.config else None,
            multicast_scouting=table.multicast_scouting and not connect,
            security=security,
        )
    return Subscription(ZenohBus.open(options, name, RealClock()), timeout_s, smoothing)


def _live_pose(posed: Posed) -> LivePose:
    anatomy, pose, bap = posed.anatomy, posed.pose, posed.message
    angles = dict(zip(anatomy.angles, pose.angles.tolist(), strict=True))
    names = tuple(marker.name for marker in anatomy.markers)
    centres = joint_centres(anatomy, posed.body, pose)
    limbs, heading = (bap.limbs, bap.heading) if isinstance(bap, TrackerPose) else ({}, None)
    position = np.asarray(pose.position)
    return LivePose(bap.frame, bap.captured_ns, position, angles, names, centres, is_lost(bap), limbs, heading)
