"""Messages that viewers publish for the films, recorded beforehand for the stand-ins."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from zenocap.common.arrays import Bytes
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import PartialBap, Sighting, Silhouette
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Viewer, load_rig
from zenocap.common.rig.sources import Rendered
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.session.session import Session
from zenocap.common.topics import PARTIAL_BAP, SIGHTING, SILHOUETTE
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.shell import service_of
from zenocap.services.viewer.sources.rendered import opened
from zenocap.tools.measure.scene import FILM_FPS
from zenocap.tools.takes.members import cameras, members

LEARNING_FRAMES = 12  # repetitions of the first image, to learn the background and find the pose
EPOCH_NS = 1_000_000_000_000


@dataclass(frozen=True)
class RecordedMessages:
    """Messages of one image.  sighting, bap: None with method hybrid."""

    silhouette: Silhouette
    sighting: Sighting | None = None
    bap: PartialBap | None = None


def record_messages(rig_file: Path, watch: Callable[[int, int], None] = lambda done, of: None) -> None:
    """Track a rig's films once, and write each viewer's messages to their folder, unless they exist.

    Viewers of a rig with a tracker run alone.  watch: is called with the number of images done, and of all.
    Raises UserError, SourceError, OSError, ValueError.
    """
    rig = load_rig(rig_file)
    if all(messages_file(viewer).exists() for viewer in rig.viewers):
        return
    alone = method_of(rig.method).only_silhouettes
    services = [service_of(rig, viewer) for viewer in rig.viewers] if alone else members(rig)
    session = Session(rig.name, ManualClock(EPOCH_NS), services, (SILHOUETTE, SIGHTING, PARTIAL_BAP))
    for camera in cameras(rig, EPOCH_NS):
        session.publish(camera)
    count = LEARNING_FRAMES + len(_pictures(rig.viewers[0]))
    recorded: dict[str, list[RecordedMessages]] = {viewer.id: [] for viewer in rig.viewers}
    last: dict[str, RecordedMessages] = {}
    for index, frames in enumerate(zip(*(_learning_then_all(viewer) for viewer in rig.viewers), strict=True)):
        _collect(session.frames({viewer.id: frame for viewer, frame in zip(rig.viewers, frames, strict=True)}), last)
        if index >= LEARNING_FRAMES:
            for id, messages in recorded.items():
                messages.append(last[id])
        watch(index + 1, count)
    if not alone and any(one.bap is None for one in last.values()):
        raise ValueError("the films were not tracked: a viewer published no partial BAP")
    for viewer in rig.viewers:
        messages_file(viewer).write_bytes(msgspec.msgpack.encode(recorded[viewer.id]))


def messages_file(viewer: Viewer) -> Path:
    """Path of the messages, in the folder of a viewer's film.  Raises ValueError when it has none."""
    if not isinstance(viewer.source, Rendered):
        raise ValueError(f"viewer {viewer.id}: its source is not a rendered film")
    return viewer.source.path.with_suffix(".messages")


def read_messages(path: Path) -> tuple[RecordedMessages, ...]:
    """Messages of each image of the film.  Raises OSError and msgspec.DecodeError."""
    return msgspec.msgpack.decode(path.read_bytes(), type=tuple[RecordedMessages, ...])


def _learning_then_all(viewer: Viewer) -> Iterator[Frame]:
    """The first image LEARNING_FRAMES times, then every image once."""
    pictures = _pictures(viewer)
    for index in range(LEARNING_FRAMES + len(pictures)):
        yield Frame(index, EPOCH_NS + round(index * 1e9 / FILM_FPS), pictures[max(0, index - LEARNING_FRAMES)].copy())


def _pictures(viewer: Viewer) -> Bytes:
    assert isinstance(viewer.source, Rendered)  # checked by messages_file
    return opened(viewer.source.path)


def _collect(received: Sequence[Envelope], last: dict[str, RecordedMessages]) -> None:
    for envelope in received:
        match envelope.message:
            case Silhouette() as silhouette:
                last[silhouette.viewer] = replace(
                    last.get(silhouette.viewer) or RecordedMessages(silhouette), silhouette=silhouette
                )
            case Sighting() as sighting:
                last[sighting.viewer] = replace(last[sighting.viewer], sighting=sighting)
            case PartialBap() as bap:
                last[bap.viewer] = replace(last[bap.viewer], bap=bap)
