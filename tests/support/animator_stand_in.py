"""Animator without a network: page, bridge, two cameras, a moving simulated person."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import cv2
import msgspec
import numpy as np

from tests.support.built_messages import silhouette
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.observe.view import RigView
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.runtime.clock import Clock, RealClock
from zenocap.common.topics import topic_of
from zenocap.services.animator.body_geometry import part_outlines
from zenocap.services.animator.outputs.output_group import OutputGroup
from zenocap.services.animator.page_bridge import PageBridge
from zenocap.services.animator.presence import Presence, observed
from zenocap.services.animator.states import TOPICS, AnimatorSetup, AnimatorState
from zenocap.services.animator.step import step
from zenocap.services.viewer.shell import camera_info
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp, truth
from zenocap.simulation.motion.timeline import MotionTimeline, motion_timeline

SETUP = AnimatorSetup(("1", "2"))
EXPECTED = (("viewer", "1"), ("viewer", "2"), ("integrator", "main"))
NOW = 1_700_000_000_000_000_000


def received(message: m.Message, received_ns: int, rig: str = "demo") -> Envelope:
    """The message as delivered by the bus."""
    topic = topic_of(type(message))
    return Envelope(topic.at(rig, **topic.names_of(message)), topic, message, received_ns)


def after(*messages: m.Message, state: AnimatorState | None = None, now_ns: int = NOW) -> AnimatorState:
    """State after messages that are received at a time, from `state` or the initial one.  The step publishes nothing."""
    state = state or AnimatorState()
    for message in messages:
        state, published = step(SETUP, state, received(message, now_ns))
        assert published == []
    return state


def observed_after(*events: m.Message | Alive, presence: Presence | None = None, now_ns: int = NOW) -> Presence:
    """Presence after events that are received at a time."""
    presence = presence or Presence(RigView("demo", EXPECTED))
    for event in events:
        presence = observed(presence, event if isinstance(event, Alive) else received(event, now_ns), now_ns)
    return presence


def health(
    service: str, id: str, now_ns: int, state: str = "tracking", phase: m.Phase = m.Phase.TRACKING, **counts: int
) -> m.Health:
    return m.Health(
        frame=0, captured_ns=now_ns, service=service, id=id, phase=phase, state=state, rate=15.0,
        stages_ms={"frame_age": 1.5}, counts=counts, clock_offset_ns=120_000, clock_error_ns=300_000,
        memory_bytes=180_000_000,
    )  # fmt: skip


@cache
def script(motion: str = "walking") -> MotionTimeline:
    return motion_timeline(person(7), motion, 7)


@cache
def body() -> Bdp:
    return true_bdp(person(7))


def pose_at(time_s: float, motion: str = "walking") -> Pose:
    """Pose of the person in the ten-part anatomy.  time_s: since the motion began."""
    actor_pose = script(motion).pose_at(script(motion).motion_from_s + time_s)
    assert actor_pose is not None
    return truth(person(7), actor_pose).ten_part_pose()


def body_message(now_ns: int) -> m.UniversalBdp:
    return m.UniversalBdp(frame=0, captured_ns=now_ns, body=body_of(TEN_PARTS, body()), ratio=1.0)


def bap(frame: int, now_ns: int, pose: Pose, lost: Sequence[str] = ()) -> m.UniversalBap:
    x, y, z = pose.position.tolist()
    return m.UniversalBap(
        frame=frame, captured_ns=now_ns, position=(x, y, z), angles=angles_by_name(TEN_PARTS, pose.angles),
        scores={"1": 0.8, "2": 0.8}, views={"1": "facade", "2": "flank"}, stale=[], lost=list(lost),
    )  # fmt: skip


def command_result(
    number: int, now_ns: int, target: str, posture: str = "raise-right-arm", outcome: str = "done"
) -> m.CommandResult:
    """Command 20 ms after the pose, which was 0.3 s after the end of a posture of 2 s."""
    return msgspec.convert(
        {
            "type": "command_result", "frame": number, "captured_ns": now_ns - 20_000_000, "posture": posture,
            "action": "zenoh", "target": target, "confidence": 0.4, "latency_ns": 20_000_000, "since_end_ns": 320_000_000,
            "since_start_ns": 2_320_000_000, "outcome": outcome,
        },
        m.CommandResult,
    )  # fmt: skip


def mask_of(camera: Camera, pose: Pose) -> Floats:
    """Mask of the model, (height, width)."""
    mask = np.zeros(camera.size[::-1], np.uint8)
    for _, corners in part_outlines(TEN_PARTS, body(), pose, camera):
        cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 1)
    return mask


def sighting(viewer: str, frame: int, now_ns: int) -> m.Sighting:
    return m.Sighting(
        frame=frame, captured_ns=now_ns, viewer=viewer, present=True, x=0.0, y=0.0, height=0.3, width=0.1,
        view="facade" if viewer == "1" else "flank", score=0.81,
    )  # fmt: skip


def assignment(frame: int, now_ns: int, pose: Pose, *, tracking: bool = True) -> m.Assignment:
    x, y, z = pose.position.tolist()
    views = {"1": "facade", "2": "flank"}
    return m.Assignment(
        frame=frame, captured_ns=now_ns, position=(x, y, z), yaw=0.0, lean=0.0, roll=0.0, squatting=False,
        tracking=tracking,
        views={id: m.ViewAssignment(frame=frame, view=view, scale=1.0, stale=False) for id, view in views.items()},
    )  # fmt: skip


class StandIn:
    """The animator of the demo rig; `receive`, `tick` and `send_frame_set` are its inputs."""

    def __init__(self, page: PageTable, takes: Path, rig: Rig | None = None, clock: Clock | None = None) -> None:
        self.rig = rig or demo_rig("two-view")
        self.clock = clock or RealClock()
        self.bus = LocalNetwork(self.rig.name, self.clock).bus()
        self.state = AnimatorState()
        self.bridge = PageBridge(self.rig, self.bus, self.clock, OutputGroup(()))
        self.bridge.open(page, takes, TOPICS)
        self.frame = 0

    @property
    def address(self) -> str:
        return self.bridge.address

    def receive(self, *events: m.Message | Alive) -> None:
        """Pass messages on as received now."""
        for event in events:
            now_ns = self.clock.now_ns()
            one = event if isinstance(event, Alive) else received(event, now_ns, self.rig.name)
            self.bridge.receive(one)
            self.state, _ = step(SETUP, self.state, one)
        self.bridge.show(self.state)

    def tick(self) -> None:
        self.state, _ = step(SETUP, self.state, Tick(self.clock.now_ns()))
        self.bridge.show(self.state)

    def begin(self) -> None:
        """Start: all services are alive, cameras and body are published."""
        now_ns = self.clock.now_ns()
        self.receive(*(Alive(service, id, True, now_ns) for service, id in EXPECTED))
        self.receive(*(camera_info(viewer, now_ns) for viewer in self.rig.viewers), body_message(now_ns))
        self.send_health()

    def send_health(self, viewers: Sequence[str] = ("1", "2"), *, log: int = 100, recording: bool = True) -> None:
        """Pass on health of the integrator and of these viewers."""
        now_ns = self.clock.now_ns()
        self.receive(
            *(health("viewer", viewer, now_ns) for viewer in viewers),
            health("integrator", "main", now_ns, log_messages=log, log_on=int(recording)),
        )

    def send_frame_set(self, time_s: float, viewers: Sequence[str] = ("1", "2"), motion: str = "walking") -> Pose:
        """Pass on the messages of one frame set; return the pose."""
        pose, now_ns = pose_at(time_s, motion), self.clock.now_ns()
        self.frame += 1
        for viewer in self.rig.viewers:
            if viewer.id in viewers:
                mask = mask_of(viewer.camera, pose)
                self.receive(silhouette(viewer.id, self.frame, now_ns, mask), sighting(viewer.id, self.frame, now_ns))
        self.receive(assignment(self.frame, now_ns, pose), bap(self.frame, now_ns, pose))
        return pose

    def close(self) -> None:
        self.bridge.close()


@contextmanager
def stand_in(takes: Path, clock: Clock | None = None, rig: Rig | None = None, **page: object) -> Iterator[StandIn]:
    """Yield a stand-in.  rig: of two-view by default.  page: fields of its table; any free port."""
    one = StandIn(msgspec.convert({"port": 0} | page, PageTable), takes, rig, clock)
    try:
        yield one
    finally:
        one.close()
