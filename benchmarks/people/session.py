"""The services of a rig in one process: frames of a film in, messages and poses out."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar, cast

from benchmarks.people.errors import Estimate, estimate_of
from benchmarks.people.films import Film
from zenocap.common import messages as m
from zenocap.common.body.definition import Bdp
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import anatomy_of, bdp_of, pose_of
from zenocap.common.rig.file import LogTable, ZenohTable
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig, load_rig
from zenocap.common.rig.sources import Background, FirstFrames, Rendered
from zenocap.common.rig.tracker import TrackerSpec, TrackerTable, tracker_spec
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.rig.viewers import Viewer
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.session.session import Session
from zenocap.common.topics import TOPICS
from zenocap.services.viewer.frame import Frame, SegmentedFrame
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.inputs import Inputs
from zenocap.tools.takes.members import members
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import opened, tolerance_ns

NAME = "evaluation"
M = TypeVar("M", bound=m.Message)


@dataclass
class Track:
    """Messages of a session in their order.  estimates: by frame, with the body of that frame."""

    messages: list[m.Message] = field(default_factory=list)
    estimates: dict[int, Estimate] = field(default_factory=dict)

    def of(self, kind: type[M]) -> list[M]:
        return [one for one in self.messages if isinstance(one, kind)]


def tracker_of(method: str = "hybrid", **changes: object) -> TrackerSpec:
    """Settings of a tracker without prior, some of them changed."""
    return replace(tracker_spec(TrackerTable(), method, True, Path()), **({"prior": None} | changes))  # type: ignore[arg-type]


def rig_of(
    cameras: Mapping[str, Camera], background: Background, fps: float, method: str, additions: Additions = IMPROVED,
    tracker: TrackerSpec | None = None, **of_viewers: bool,
) -> Rig:  # fmt: skip
    """Rig of cameras, by viewer, whose frames a session is given.  tracker: by default without prior."""
    viewers = tuple(
        Viewer(id, one, one.size, Rendered(Path(), fps), background, fps, preview=False, silhouette=False, **of_viewers)
        for id, one in cameras.items()
    )
    row = method_of(method)
    spec = (tracker or tracker_of(row.tracker_method)) if row.has_tracker else None
    return Rig(
        NAME, method, viewers, (), Path(), "0" * 16, ZenohTable(), LogTable(), (), tracker=spec, additions=additions
    )  # fmt: skip


def stepped(rig: Rig, frame_sets: Iterable[Mapping[str, Frame | SegmentedFrame]]) -> Iterator[Sequence[m.Message]]:
    """The messages that result from each frame set, frames or silhouettes by viewer."""
    session = Session(rig.name, ManualClock(EPOCH_NS), members(rig), TOPICS)
    for frames in frame_sets:
        yield [one.message for one in session.frames(cast(Mapping[str, Frame], frames))]


def frame_sets(film: Film) -> Iterator[Mapping[str, Frame]]:
    """The frames of a film, by viewer."""
    for k in range(len(film.truths)):
        captured_ns = EPOCH_NS + round(k * 1e9 / film.fps)
        yield {id: Frame(k, captured_ns, images[k]) for id, images in film.images.items()}


def tracked(
    film: Film, method: str = "hybrid", additions: Additions = IMPROVED, tracker: TrackerSpec | None = None
) -> Track:
    """The track of a film whose first `film.empty` frames are the background."""
    rig = rig_of(film.cameras, FirstFrames(film.empty), film.fps, method, additions, tracker)
    return track_of(stepped(rig, frame_sets(film)))


def tracked_clip(folder: Path, size: tuple[int, int], additions: Additions) -> Track:
    """The track of a shared clip of two cameras by two-view, at a working size (width, height).  Raises UserError."""
    rig = replace(at_working_size(load_rig(folder, "two-view"), size, None), additions=additions)
    inputs = Inputs()
    sources = opened(rig, ManualClock(EPOCH_NS), inputs)
    return track_of(stepped(rig, inputs.frame_sets(sources, tolerance_ns(rig))))


def track_of(frame_sets: Iterator[Sequence[m.Message]]) -> Track:
    track, body = Track(), None
    for messages in frame_sets:
        track.messages += messages
        for message in messages:
            match message:
                case m.UniversalBdp() | m.TrackerBdp():
                    body = anatomy_of(message.body), bdp_of(anatomy_of(message.body), message.body)
                case m.UniversalBap() | m.TrackerPose() if body is not None and not _lost(message):
                    track.estimates[message.frame] = estimate_of(*body, pose_of(body[0], message))
    return track


def _lost(message: m.UniversalBap | m.TrackerPose) -> bool:
    return isinstance(message, m.TrackerPose) and message.lost


def last_body(track: Track) -> Bdp | None:
    """The body at the end; None without one."""
    found = [one for one in track.messages if isinstance(one, m.UniversalBdp | m.TrackerBdp)]
    return bdp_of(anatomy_of(found[-1].body), found[-1].body) if found else None
