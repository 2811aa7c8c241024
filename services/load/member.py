"""Members of a load that are no services of zenocap: stand-ins for viewers, and subscribers.  Started by the crew:

python -m services.load.member stand-in|subscriber RIG --id ID --epoch-ns N [Zenoh options]
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from common.bus.protocol import BusError, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Assignment, Message
from common.runtime import logs
from common.runtime.clock import RealClock
from common.runtime.rig import RigError, Viewer, load_rig
from common.runtime.service import Event, Service, Subscription, run
from common.runtime.signals import stop_signals
from common.topics import ASSIGNMENT, HANDLED, TOPICS
from services.load.material import Said, read_said, said_file
from services.load.stage import FILM_FPS
from services.viewer.shell import camera_info
from services.viewer.sources.frame import Playback, SourceError
from services.viewer.sources.rendered import there_and_back

FAILED = 1


@dataclass(frozen=True)
class Due:
    """A frame without a picture."""

    frame: int
    captured_ns: int


@dataclass(frozen=True)
class Setup:
    """said: by picture of the film.  fps: of this viewer."""

    viewer: str
    said: tuple[Said, ...]
    fps: float

    def of(self, frame: int) -> Said:
        return self.said[there_and_back(int(frame * FILM_FPS / self.fps + 1e-6), len(self.said))]


def step(setup: Setup, waiting: Due | None, event: Event[Due]) -> tuple[Due | None, Sequence[Message]]:
    """A frame is a silhouette and a sighting; the assignment that answers it is a partial BAP, as of a real viewer."""
    match event:
        case Due(frame=frame, captured_ns=captured_ns):
            said = setup.of(frame)
            messages: list[Message] = [replace(said.silhouette, frame=frame, captured_ns=captured_ns)]
            if said.sighting is not None:
                messages.append(replace(said.sighting, frame=frame, captured_ns=captured_ns))
            return event, messages
        case Envelope(message=Assignment(tracking=True, views=views)) if waiting is not None:
            mine, bap = views.get(setup.viewer), setup.of(waiting.frame).bap
            if mine is None or mine.stale or mine.frame != waiting.frame or bap is None:
                return waiting, []
            return None, [replace(bap, frame=waiting.frame, captured_ns=waiting.captured_ns, view=mine.view)]
        case _:
            return waiting, []


def due(fps: float, playback: Playback) -> Iterator[Due]:
    """For ever: frame n at `epoch_ns` + n / fps; those that are late are left out."""
    index = 0
    while True:
        index = max(index, int((playback.clock.now_ns() - playback.epoch_ns) * fps / 1e9))
        playback.wait_until(playback.time_of(index, fps))
        yield Due(index, playback.time_of(index, fps))
        index += 1


def run_stand_in(viewer: Viewer, rig: str, epoch_ns: int, options: ZenohOptions) -> int:
    """Until stopped; returns the exit status.  rig: its name.  Raises BusError and OSError."""
    setup, clock = Setup(viewer.id, read_said(said_file(viewer)), viewer.fps), RealClock()
    service: Service[Setup, Due | None, Due] = Service(
        "viewer", viewer.id, setup, None, step, (Subscription(ASSIGNMENT),), describe=lambda _: "standing in"
    )
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig, clock, stopped) as bus:
        frames = due(viewer.fps, Playback(epoch_ns, clock))
        return run(service, bus, clock, frames, stopped, greeting=(camera_info(viewer, epoch_ns),))


def run_subscriber(rig: str, id: str, options: ZenohOptions) -> int:
    """Hears every message of a rig, decodes and counts it, until stopped; returns the exit status.  Raises BusError."""
    clock = RealClock()
    topics = tuple(Subscription(topic, every=True) for topic in TOPICS if topic is not HANDLED)
    service: Service[None, int, Due] = Service(
        "subscriber", id, None, 0, _count, topics, describe=lambda heard: f"{heard} messages", count=_heard, derives=False
    )
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig, clock, stopped) as bus:
        return run(service, bus, clock, stopped=stopped)


def _count(_: None, heard: int, event: Event[Due]) -> tuple[int, Sequence[Message]]:
    return heard + isinstance(event, Envelope), []


def _heard(heard: int) -> Mapping[str, int]:
    return {"heard": heard}


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("stand-in", "subscriber"))
    parser.add_argument("rig", type=Path)
    parser.add_argument("--id", required=True)
    parser.add_argument("--epoch-ns", type=int, default=0)
    parser.add_argument("--mode", choices=("peer", "client"))
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--listen", action="append", default=[])
    parser.add_argument("--config", type=Path)
    parser.add_argument("--no-multicast-scouting", action="store_true")
    given = parser.parse_args(arguments)
    logs.configure(f"{given.kind} {given.id}")
    options = ZenohOptions(
        given.mode, tuple(given.connect), tuple(given.listen), given.config, not given.no_multicast_scouting
    )
    try:
        rig = load_rig(given.rig)
        if given.kind == "subscriber":
            return run_subscriber(rig.name, given.id, options)
        return run_stand_in(rig.viewer(given.id), rig.name, given.epoch_ns, options)
    except (BusError, RigError, SourceError, OSError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return FAILED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
