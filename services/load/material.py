"""What real viewers said of the films, message by message, for the stand-ins to say again."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from common import codec
from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Envelope
from common.messages import PartialBap, Sighting, Silhouette
from common.runtime.clock import ManualClock
from common.runtime.rig import Rig, Viewer, load_rig
from common.runtime.specs import Rendered
from common.topics import PARTIAL_BAP, SIGHTING, SILHOUETTE
from services.load.stage import FILM_FPS
from services.takes.offline import Offline
from services.viewer.shell import silhouette_service
from services.viewer.sources.frame import Frame
from services.viewer.sources.rendered import opened

FIRST = 12  # times that the first picture is shown before: the background is learnt, and the pose found
EPOCH_NS = 1_000_000_000_000


@dataclass(frozen=True)
class Said:
    """Of one picture.  sighting, bap: None where the tracker does the rest."""

    silhouette: Silhouette
    sighting: Sighting | None = None
    bap: PartialBap | None = None


def rehearse(rig_file: Path, watch: Callable[[int, int], None] = lambda done, of: None) -> None:
    """Track a rig's films once, and write what each viewer said beside them, unless it is there.

    watch: how many pictures are done, and of how many.  Raises RigError, SourceError, OSError, ValueError.
    """
    rig = load_rig(rig_file)
    if all(said_file(viewer).exists() for viewer in rig.viewers):
        return
    for viewer, said in zip(
        rig.viewers, _tracked(rig, watch) if rig.tracker is None else _watched(rig, watch), strict=True
    ):
        each = [[b"" if m is None else codec.encode(m) for m in (s.silhouette, s.sighting, s.bap)] for s in said]
        said_file(viewer).write_bytes(msgspec.msgpack.encode(each))


def said_file(viewer: Viewer) -> Path:
    """Beside the film of a viewer.  Raises ValueError when it has none."""
    if not isinstance(viewer.source, Rendered):
        raise ValueError(f"viewer {viewer.id}: its source is no film that was rendered beforehand")
    return viewer.source.path.with_suffix(".said")


def read_said(path: Path) -> tuple[Said, ...]:
    """By picture of the film.  Raises OSError, msgspec.DecodeError and BadMessage."""
    each = msgspec.msgpack.decode(path.read_bytes(), type=list[tuple[bytes, bytes, bytes]])
    return tuple(
        Said(
            codec.decode(silhouette, Silhouette),
            codec.decode(sighting, Sighting) if sighting else None,
            codec.decode(bap, PartialBap) if bap else None,
        )
        for silhouette, sighting, bap in each
    )


def _shown(viewer: Viewer) -> Iterator[Frame]:
    """The first picture FIRST times, then every picture once."""
    pictures = _pictures(viewer)
    for index in range(FIRST + len(pictures)):
        yield Frame(index, EPOCH_NS + round(index * 1e9 / FILM_FPS), pictures[max(0, index - FIRST)].copy())


def _pictures(viewer: Viewer) -> NDArray[np.uint8]:
    assert isinstance(viewer.source, Rendered)  # as said_file has checked
    return opened(viewer.source.path)


def _tracked(rig: Rig, watch: Callable[[int, int], None]) -> Iterable[tuple[Said, ...]]:
    """By viewer, with sightings and partial BAPs, as the viewers and the integrator find them together."""
    clock = ManualClock(EPOCH_NS)
    network = LocalNetwork(rig.name, clock)
    offline, heard = Offline(rig, network), network.bus()
    for topic in (SILHOUETTE, SIGHTING, PARTIAL_BAP):
        heard.subscribe(topic, every=True)
    offline.greet(EPOCH_NS)
    count = FIRST + len(_pictures(rig.viewers[0]))
    said: dict[str, list[Said]] = {viewer.id: [] for viewer in rig.viewers}
    last: dict[str, Said] = {}
    for index, frames in enumerate(zip(*(_shown(viewer) for viewer in rig.viewers), strict=True)):
        clock.set(frames[0].captured_ns)
        offline.see({viewer.id: frame for viewer, frame in zip(rig.viewers, frames, strict=True)})
        _listen(heard, last)
        if index >= FIRST:
            for viewer, sayings in said.items():
                sayings.append(last[viewer])
        watch(index + 1, count)
    if any(one.bap is None for one in last.values()):
        raise ValueError("the films were not tracked: a viewer gave no partial BAP")
    return [tuple(sayings) for sayings in said.values()]


def _listen(bus: LocalBus, last: dict[str, Said]) -> None:
    while (event := bus.receive()) is not None:
        match event:
            case Envelope(message=Silhouette() as silhouette):
                last[silhouette.viewer] = replace(last.get(silhouette.viewer) or Said(silhouette), silhouette=silhouette)
            case Envelope(message=Sighting() as sighting):
                last[sighting.viewer] = replace(last[sighting.viewer], sighting=sighting)
            case Envelope(message=PartialBap() as bap):
                last[bap.viewer] = replace(last[bap.viewer], bap=bap)


def _watched(rig: Rig, watch: Callable[[int, int], None]) -> Iterator[tuple[Said, ...]]:
    """By viewer, silhouettes alone."""
    for number, viewer in enumerate(rig.viewers):
        service = silhouette_service(viewer)
        state, said = service.state, []
        for frame in _shown(viewer):
            state, messages = service.step(service.setup, state, frame)
            said += [Said(message) for message in messages if isinstance(message, Silhouette) and frame.frame >= FIRST]
        watch(number + 1, len(rig.viewers))
        yield tuple(said)
