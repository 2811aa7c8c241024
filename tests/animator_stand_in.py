"""An animator without a network: its desk and its page, and a rig of two cameras whose synthetic person moves."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import cv2
import msgspec
import numpy as np

from common import messages as m
from common.actor.person import person
from common.actor.script import Script, motion_script
from common.actor.truth import true_bdp, truth
from common.body.anatomy import TEN_PARTS, Floats
from common.body.definition import Bdp, Pose
from common.bus.local import LocalNetwork
from common.bus.protocol import Alive, Envelope, Tick
from common.camera.pinhole import Camera
from common.conversion import angles_by_name, body_of
from common.runtime.animator_table import PageTable
from common.runtime.clock import Clock, RealClock
from common.runtime.rig import Rig, demo_rig
from common.topics import topic_of
from common.vision.packing import pack
from services.animator.outlines import outlines
from services.animator.outputs.opening import Outputs
from services.animator.shell import Desk
from services.animator.states import Setup, State
from services.animator.step import initial_state, step
from services.viewer.shell import camera_info

SETUP = Setup((("viewer", "1"), ("viewer", "2"), ("integrator", "main")))


def said(message: m.Message, received_ns: int, rig: str = "demo") -> Envelope:
    """A message as it would come from the bus."""
    topic = topic_of(type(message))
    return Envelope(topic.at(rig, **topic.names_of(message)), topic, message, received_ns)


def health(service: str, id: str, now_ns: int, state: str = "tracking", **counts: int) -> m.Health:
    return m.Health(
        frame=0, captured_ns=now_ns, service=service, id=id, state=state, rate=15.0, stages_ms={"frame_age": 1.5},
        counts=counts, clock_offset_ns=120_000, clock_error_ns=300_000, memory_bytes=180_000_000,
    )  # fmt: skip


@cache
def script(motion: str = "walking") -> Script:
    return motion_script(person(7), motion, 7)


@cache
def body() -> Bdp:
    return true_bdp(person(7))


def pose_at(time_s: float, motion: str = "walking") -> Pose:
    """The person's pose, by the ten-part anatomy; time_s: since the motion began."""
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


def mask_of(camera: Camera, pose: Pose) -> Floats:
    """The model filled, (height, width)."""
    mask = np.zeros(camera.size[::-1], np.uint8)
    for _, corners in outlines(TEN_PARTS, body(), pose, camera):
        cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 1)
    return mask


def silhouette(viewer: str, frame: int, now_ns: int, mask: Floats) -> m.Silhouette:
    region, data = pack(mask)
    return m.Silhouette(frame=frame, captured_ns=now_ns, viewer=viewer, size=mask.shape[::-1], region=region, data=data)


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
    """The animator of the demo's rig; what it hears is told by `hear`, `tick` and `instant`."""

    def __init__(self, page: PageTable, takes: Path, rig: Rig | None = None, clock: Clock | None = None) -> None:
        self.rig = rig or demo_rig()
        self.clock = clock or RealClock()
        self.bus = LocalNetwork(self.rig.name, self.clock).bus()
        self.state: State = initial_state(SETUP)
        self.desk = Desk(self.rig, self.bus, self.clock, Outputs(()))
        self.desk.open(page, takes)
        self.frame = 0

    @property
    def address(self) -> str:
        return self.desk.address

    def hear(self, *events: m.Message | Alive) -> None:
        """Now."""
        for event in events:
            now_ns = self.clock.now_ns()
            one = event if isinstance(event, Alive) else said(event, now_ns, self.rig.name)
            self.state, _ = step(SETUP, self.state, one)
        self.desk.show(self.state)

    def tick(self) -> None:
        self.state, _ = step(SETUP, self.state, Tick(self.clock.now_ns()))
        self.desk.show(self.state)

    def begin(self) -> None:
        """Everybody is there, and the body is known."""
        now_ns = self.clock.now_ns()
        self.hear(*(Alive(service, id, True, now_ns) for service, id in SETUP.expected))
        self.hear(*(camera_info(viewer, now_ns) for viewer in self.rig.viewers), body_message(now_ns))
        self.well()

    def well(self, viewers: Sequence[str] = ("1", "2"), *, log: int = 100, recording: bool = True) -> None:
        """Everybody says so, or these viewers alone and the integrator."""
        now_ns = self.clock.now_ns()
        self.hear(
            *(health("viewer", viewer, now_ns) for viewer in viewers),
            health("integrator", "main", now_ns, log_messages=log, log_on=int(recording)),
        )

    def instant(self, time_s: float, viewers: Sequence[str] = ("1", "2"), motion: str = "walking") -> Pose:
        """What is said of one instant; returns the pose."""
        pose, now_ns = pose_at(time_s, motion), self.clock.now_ns()
        self.frame += 1
        for viewer in self.rig.viewers:
            if viewer.id in viewers:
                mask = mask_of(viewer.camera, pose)
                self.hear(silhouette(viewer.id, self.frame, now_ns, mask), sighting(viewer.id, self.frame, now_ns))
        self.hear(assignment(self.frame, now_ns, pose), bap(self.frame, now_ns, pose))
        return pose

    def play(self, seconds: float, viewers: Sequence[str] = ("1", "2"), fps: float = 15.0, motion: str = "walking") -> None:
        """In real time."""
        started_s, second = time.monotonic(), -1
        for k in range(round(seconds * fps)):
            time.sleep(max(0.0, started_s + k / fps - time.monotonic()))
            self.instant(self.frame / fps, viewers, motion)
            if int(k / fps) != second:
                second = int(k / fps)
                self.well()
            self.tick()

    def close(self) -> None:
        self.desk.close()


@contextmanager
def stand_in(takes: Path, clock: Clock | None = None, **page: object) -> Iterator[StandIn]:
    """page: its table, on any free port."""
    one = StandIn(msgspec.convert({"port": 0} | page, PageTable), takes, clock=clock)
    try:
        yield one
    finally:
        one.close()
