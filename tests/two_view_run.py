"""Two viewers and the integrator driven by hand: events in, pure steps, messages on to whom they concern; no bus."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

from actor_cameras import paper_cameras

from common import messages as m
from common.actor.person import person
from common.actor.render import ActorCamera
from common.actor.script import posture_take
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Envelope
from common.runtime.specs import FirstFrames
from common.topics import topic_of
from services.integrator import states as integrator_states
from services.integrator import step as integrator
from services.viewer import states as viewer_states
from services.viewer import step as viewer
from services.viewer.sources.frame import Frame

SIZE = (160, 120)
FPS = 15
FRAME_NS = round(1e9 / FPS)
EPOCH_NS = 1_000 * FRAME_NS
VIEWERS = ("1", "2")
EMPTY_FRAMES = 10
PERSON, POSTURE, SEED = 3, "raise-both-arms", 1


def envelope(message: m.Message) -> Envelope:
    topic = topic_of(type(message))
    names = {name: getattr(message, name) for name in ("viewer", "service", "id") if hasattr(message, name)}
    return Envelope(topic.at("test", **names), topic, message, message.captured_ns)


@cache
def film(count: int) -> tuple[dict[str, Frame], ...]:
    """The first frames of a posture take, by viewer: empty scene, initial posture, arms down, posture."""
    somebody = person(PERSON)
    script = posture_take(somebody, POSTURE, SEED)
    cameras = [ActorCamera(camera, somebody, SEED) for camera in paper_cameras(SIZE)]
    frames = []
    for k in range(count):
        pose = script.pose_at(k / FPS)
        images = [camera.render(pose, k) for camera in cameras]
        frames.append({id: Frame(k, EPOCH_NS + k * FRAME_NS, image) for id, image in zip(VIEWERS, images, strict=True)})
    return tuple(frames)


def integrator_setup(height: float | None = None) -> integrator_states.Setup:
    cameras = dict(zip(VIEWERS, paper_cameras(SIZE), strict=True))
    return integrator.integrator_setup(TEN_PARTS, cameras, FRAME_NS, height)


def viewer_setup(id: str) -> viewer_states.Setup:
    camera = paper_cameras(SIZE)[VIEWERS.index(id)]
    return viewer_states.viewer_setup(id, camera, FirstFrames(EMPTY_FRAMES), publish_silhouette=False)


@dataclass
class Run:
    """Everything that was said, in order."""

    integrator: integrator_states.State = field(default_factory=lambda: integrator.initial_state(integrator_setup()))
    viewers: dict[str, viewer_states.State] = field(
        default_factory=lambda: {id: viewer.initial_state(viewer_setup(id)) for id in VIEWERS}
    )
    said: list[m.Message] = field(default_factory=list)

    def see(self, frames: dict[str, Frame]) -> list[m.Message]:
        """One instant and all that follows from it."""
        before = len(self.said)
        for id, frame in frames.items():
            self.viewers[id], messages = viewer.step(viewer_setup(id), self.viewers[id], frame)
            self.tell_integrator(messages)
        return self.said[before:]

    def tell_integrator(self, messages: Sequence[m.Message]) -> None:
        self.said += messages
        for message in messages:
            self.integrator, answers = integrator.step(integrator_setup(), self.integrator, envelope(message))
            self.tell_viewers(answers)

    def tell_viewers(self, messages: Sequence[m.Message]) -> None:
        self.said += messages
        replies: list[m.Message] = []
        for message in messages:
            for id in VIEWERS:
                self.viewers[id], more = viewer.step(viewer_setup(id), self.viewers[id], envelope(message))
                replies += more
        if replies:
            self.tell_integrator(replies)


def kind_of(said: Sequence[m.Message], kind: type[m.Message]) -> list[m.Message]:
    return [message for message in said if isinstance(message, kind)]
