"""Both viewers' steps and the integrator's in one process: frames in, universal BAPs out; no bus, no files."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.body.definition import Bdp
from common.bus.protocol import Envelope
from common.camera.pinhole import Camera
from common.conversion import bdp_of
from common.runtime.specs import Background, FirstFrames
from common.topics import topic_of
from services.integrator import step as integrator
from services.viewer import step as viewer
from services.viewer.sources.frame import Frame
from tests.evaluation.errors import Estimate, estimate
from tests.evaluation.takes import Film

EPOCH_NS = 1_700_000_000_000_000_000


@dataclass
class Track:
    """What came out.  body: universal BDP, None before it is known.  baps: by frame.  partials: every partial BAP."""

    body: Bdp | None = None
    baps: dict[int, m.UniversalBap] = field(default_factory=dict)
    partials: list[m.PartialBap] = field(default_factory=list)

    def estimate(self, frame: int) -> Estimate | None:
        bap = self.baps.get(frame)
        return None if bap is None or self.body is None else estimate(self.body, bap)


class Loop:
    """Messages go straight to those who read them, until there are none left; then the next frame."""

    def __init__(self, cameras: Mapping[str, Camera], backgrounds: Mapping[str, Background], fps: float) -> None:
        self._setups = {id: viewer.viewer_setup(id, camera, backgrounds[id], False) for id, camera in cameras.items()}
        self._viewers = {id: viewer.initial_state(setup) for id, setup in self._setups.items()}
        self._setup = integrator.integrator_setup(TEN_PARTS, cameras, round(1e9 / fps))
        self._integrator = integrator.initial_state(self._setup)
        self.track = Track()

    def feed(self, frames: Mapping[str, Frame]) -> list[m.Message]:
        """All messages that the frames of one instant cause, in order."""
        waiting: deque[m.Message] = deque()
        sent: list[m.Message] = []
        for id, frame in frames.items():
            self._viewers[id], said = viewer.step(self._setups[id], self._viewers[id], frame)
            waiting.extend(said)
        while waiting:
            message = waiting.popleft()
            sent.append(message)
            self._note(message)
            waiting.extend(self._deliver(message))
        return sent

    def _deliver(self, message: m.Message) -> Iterator[m.Message]:
        topic = topic_of(type(message))
        names = topic.names_of(message)
        envelope = Envelope(topic.at("evaluation", **names), topic, message, message.captured_ns)
        if "viewer" in names:
            self._integrator, said = integrator.step(self._setup, self._integrator, envelope)
            yield from said
            return
        for id, setup in self._setups.items():
            self._viewers[id], said = viewer.step(setup, self._viewers[id], envelope)
            yield from said

    def _note(self, message: m.Message) -> None:
        match message:
            case m.UniversalBdp():
                self.track.body = bdp_of(TEN_PARTS, message.body)
            case m.UniversalBap():
                self.track.baps[message.frame] = message
            case m.PartialBap():
                self.track.partials.append(message)


def track_film(film: Film, fps: float) -> Track:
    """The track of a film whose first `film.empty` frames are the background."""
    loop = Loop(film.cameras, {id: FirstFrames(film.empty) for id in film.cameras}, fps)
    for k in range(len(film.truths)):
        captured_ns = EPOCH_NS + round(k * 1e9 / fps)
        loop.feed({id: Frame(k, captured_ns, images[k]) for id, images in film.images.items()})
    return loop.track
