"""Steps of two viewers and the integrator without a bus."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import TypeVar

import numpy as np

from tests.support.simulated_cameras import paper_cameras
from tests.support.stored import stored
from zenocap.common import messages as m
from zenocap.common.arrays import Bytes
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.topics import topic_of
from zenocap.services.integrator import states as integrator_states
from zenocap.services.integrator import step as integrator
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.two_view import step as viewer
from zenocap.services.viewer.two_view.states import TwoViewSetup
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import posture_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE = (160, 120)
FPS = 15
FRAME_NS = round(1e9 / FPS)
EPOCH_NS = 1_000 * FRAME_NS
VIEWERS = ("1", "2")
EMPTY_FRAMES = 10
Kind = TypeVar("Kind", bound=m.Message)
MOST_FRAMES = 120  # of the film
PERSON, POSTURE, SEED = 4, "raise-both-arms", 1


def envelope(message: m.Message) -> Envelope:
    topic = topic_of(type(message))
    names = {name: getattr(message, name) for name in ("viewer", "service", "id") if hasattr(message, name)}
    return Envelope(topic.at("test", **names), topic, message, message.captured_ns)


@cache
def film(count: int, posture: str = POSTURE) -> tuple[dict[str, Frame], ...]:
    """First frames of a posture take, by viewer: empty scene, T-pose, arms down, posture."""
    images = stored(partial(_render, posture), "two-view run", PERSON, posture, SEED, SIZE, FPS)
    assert count <= images.shape[1]
    return tuple(
        {id: Frame(k, EPOCH_NS + k * FRAME_NS, images[row, k]) for row, id in enumerate(VIEWERS)} for k in range(count)
    )


def _render(posture: str) -> Bytes:
    """(viewers, frames, height, width, 3) all frames of the take."""
    subject = person(PERSON)
    timeline = posture_timeline(subject, posture, SEED)
    cameras = [SimulatedCamera(camera, subject, SEED) for camera in paper_cameras(SIZE)]
    poses = [timeline.pose_at(k / FPS) for k in range(MOST_FRAMES)]
    return np.array([[camera.render(pose, k) for k, pose in enumerate(poses)] for camera in cameras])


def integrator_setup(height: float | None = None, additions: Additions = IMPROVED) -> integrator_states.IntegratorSetup:
    cameras = dict(zip(VIEWERS, paper_cameras(SIZE), strict=True))
    return integrator_states.integrator_setup(TEN_PARTS, cameras, FRAME_NS, height, additions=additions)


def viewer_setup(id: str, additions: Additions = IMPROVED) -> TwoViewSetup:
    camera = paper_cameras(SIZE)[VIEWERS.index(id)]
    return TwoViewSetup(id, camera, FirstFrames(EMPTY_FRAMES), additions=additions)


@dataclass
class Run:
    """All published messages, in order.  additions: of the variant."""

    additions: Additions = IMPROVED
    published: list[m.Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.setup = integrator_setup(additions=self.additions)
        self.setups = {id: viewer_setup(id, self.additions) for id in VIEWERS}
        self.integrator = integrator.initial_state(self.setup)
        self.viewers = {id: viewer.initial_state(setup) for id, setup in self.setups.items()}

    def of(self, kind: type[Kind]) -> list[Kind]:
        """The published messages of a kind."""
        return messages_of_kind(self.published, kind)

    def process(self, frames: dict[str, Frame]) -> list[m.Message]:
        """Process one frame set; return all resulting messages."""
        before = len(self.published)
        for id, frame in frames.items():
            self.viewers[id], messages = viewer.step(self.setups[id], self.viewers[id], frame)
            self.send_to_integrator(messages)
        return self.published[before:]

    def send_to_integrator(self, messages: Sequence[m.Message]) -> None:
        self.published += messages
        for message in messages:
            self.integrator, answers = integrator.step(self.setup, self.integrator, envelope(message))
            self.send_to_viewers(answers)

    def send_to_viewers(self, messages: Sequence[m.Message]) -> None:
        self.published += messages
        replies: list[m.Message] = []
        for message in messages:
            for id in VIEWERS:
                self.viewers[id], more = viewer.step(self.setups[id], self.viewers[id], envelope(message))
                replies += more
        if replies:
            self.send_to_integrator(replies)


def messages_of_kind(messages: Sequence[m.Message], kind: type[Kind]) -> list[Kind]:
    return [message for message in messages if isinstance(message, kind)]
