"""The steps of a method's services in one process: frames in, poses out; no bus, no files."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from benchmarks.errors import Estimate, estimate, estimate_of
from benchmarks.takes import Film
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.common.bus.protocol import Envelope
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import bdp_of
from zenocap.common.rig.sources import Background, FirstFrames
from zenocap.common.rig.tracker import DEFAULT_FILTER, FilterOptions
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.topics import topic_of
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.integrator import step as integrator
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.states import Options, Outcome, Setup
from zenocap.services.tracker.tracking import initial_state, track
from zenocap.services.viewer import silhouette_step
from zenocap.services.viewer import step as viewer
from zenocap.services.viewer.frame import Frame

EPOCH_NS = 1_700_000_000_000_000_000


@dataclass
class Track:
    """Result of the loop.  body: universal BDP, None until measured.  baps: by frame.  partials: every partial BAP."""

    body: Bdp | None = None
    baps: dict[int, m.UniversalBap] = field(default_factory=dict)
    partials: list[m.PartialBap] = field(default_factory=list)

    def estimate(self, frame: int) -> Estimate | None:
        bap = self.baps.get(frame)
        return None if bap is None or self.body is None else estimate(self.body, bap)


class Loop:
    """Each message is passed to its receivers until none is left; then the next frame follows."""

    def __init__(
        self,
        cameras: Mapping[str, Camera],
        backgrounds: Mapping[str, Background],
        fps: float,
        additions: Additions = IMPROVED,
    ) -> None:
        self.viewer_setups = {
            id: viewer.viewer_setup(id, camera, backgrounds[id], False, additions=additions)
            for id, camera in cameras.items()
        }
        self.viewer_states = {id: viewer.initial_state(setup) for id, setup in self.viewer_setups.items()}
        self._setup = integrator.integrator_setup(TEN_PARTS, cameras, round(1e9 / fps), additions=additions)
        self._integrator = integrator.initial_state(self._setup)
        self.track = Track()

    def feed(self, frames: Mapping[str, Frame]) -> list[m.Message]:
        """All messages that result from one frame set, in order."""
        pending: deque[m.Message] = deque()
        sent: list[m.Message] = []
        for id, frame in frames.items():
            self.viewer_states[id], published = viewer.step(self.viewer_setups[id], self.viewer_states[id], frame)
            pending.extend(published)
        while pending:
            message = pending.popleft()
            sent.append(message)
            self._store(message)
            pending.extend(self._deliver(message))
        return sent

    def _deliver(self, message: m.Message) -> Iterator[m.Message]:
        topic = topic_of(type(message))
        names = topic.names_of(message)
        envelope = Envelope(topic.at("evaluation", **names), topic, message, message.captured_ns)
        if "viewer" in names:
            self._integrator, published = integrator.step(self._setup, self._integrator, envelope)
            yield from published
            return
        for id, setup in self.viewer_setups.items():
            self.viewer_states[id], published = viewer.step(setup, self.viewer_states[id], envelope)
            yield from published

    def _store(self, message: m.Message) -> None:
        match message:
            case m.UniversalBdp():
                self.track.body = bdp_of(TEN_PARTS, message.body)
            case m.UniversalBap():
                self.track.baps[message.frame] = message
            case m.PartialBap():
                self.track.partials.append(message)


def track_film(film: Film, fps: float, additions: Additions = IMPROVED) -> Track:
    """The track of a film whose first `film.empty` frames are the background."""
    loop = Loop(film.cameras, {id: FirstFrames(film.empty) for id in film.cameras}, fps, additions)
    for k in range(len(film.truths)):
        captured_ns = EPOCH_NS + round(k * 1e9 / fps)
        loop.feed({id: Frame(k, captured_ns, images[k]) for id, images in film.images.items()})
    return loop.track


def tracker_film(
    film: Film,
    fps: float,
    prior: Prior | None = None,
    observe: Callable[[int, Outcome], None] = lambda _, __: None,
    filter: FilterOptions = DEFAULT_FILTER,
    front: str | None = None,
    heading: float | None = None,
) -> dict[int, Estimate]:
    """Estimates of the tracker by frame, for a film whose first `film.empty` frames are the background.

    observe: gets every tracked frame and its outcome.  filter: its options; the others are the defaults.
    front, heading: the user's decision, of `Options`.
    """
    frame_ns = round(1e9 / fps)
    setup = Setup(FOURTEEN_PARTS, film.cameras, frame_ns, prior, Options(filter=filter, front=front, heading=heading))
    viewers = {id: viewer.viewer_setup(id, camera, FirstFrames(film.empty), True) for id, camera in film.cameras.items()}
    segmenting = {id: silhouette_step.initial_state(one) for id, one in viewers.items()}
    state, body = initial_state(setup), None
    found: dict[int, Estimate] = {}
    for k in range(len(film.truths)):
        captured_ns = EPOCH_NS + round(k * 1e9 / fps)
        masks: dict[str, Mask] = {}
        for id, images in film.images.items():
            frame = Frame(k, captured_ns, images[k])
            segmenting[id], messages = silhouette_step.step(viewers[id], segmenting[id], frame)
            for message in messages:
                if isinstance(message, m.Silhouette):
                    masks[id] = unpack(message.size, message.region, message.data)
        if masks:
            state, outcome = track(setup, state, captured_ns, masks)
            observe(k, outcome)
            body = body if outcome.body is None else outcome.body
            if body is not None and outcome.pose is not None:
                found[k] = estimate_of(FOURTEEN_PARTS, body, outcome.pose)
    return found
