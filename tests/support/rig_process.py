"""Processes of the system tests: python -m tests.support.rig_process ROLE ..."""

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import BusError, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_router import router
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.recording.log import Log
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime import logs
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.service import Event, Service, TopicSubscription, run
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.topics import PARTIAL_BDP, SIGHTING

RIG = "systemtest"


@dataclass(frozen=True)
class Image:
    frame: int
    captured_ns: int


def sighting(viewer: str, frame: int, captured_ns: int) -> m.Sighting:
    return built(m.Sighting, frame=frame, captured_ns=captured_ns, viewer=viewer)


def bdp(viewer: str) -> m.PartialBdp:
    return m.PartialBdp(frame=0, captured_ns=0, viewer=viewer, side="front", lengths={"torso": 0.5})


def assignment(event: Envelope) -> m.Assignment:
    """Assignment in reply to a sighting, with the sighting's frame and capture time."""
    return built(m.Assignment, frame=event.message.frame, captured_ns=event.message.captured_ns)


def viewer_step(viewer: str, count: int, event: Event[Image]) -> tuple[int, Sequence[m.Message]]:
    match event:
        case Image():  # the first one that a busy machine handles may have another number than 0
            first = [] if count else [bdp(viewer)]
            return count + 1, [*first, sighting(viewer, event.frame, event.captured_ns)]
        case _:
            return count, []


def integrator_step(_: None, count: int, event: Event[Image]) -> tuple[int, Sequence[m.Message]]:
    match event:
        case Envelope(message=m.Sighting()):
            return count + 1, [assignment(event)]
        case _:
            return count, []


def images(rate: float) -> Iterator[Image]:
    """Endless frames at `rate` per second."""
    frame, start_s = 0, time.monotonic()
    while True:
        yield Image(frame, time.time_ns())
        frame += 1
        time.sleep(max(0.0, start_s + frame / rate - time.monotonic()))


def main(role: str, endpoint: str, *arguments: str) -> int:
    logs.configure(role)
    clock = RealClock()
    options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
    with stop_signals() as stopped:
        try:
            if role == "router":
                router(lambda _: ZenohOptions(listen=(endpoint,), multicast_scouting=False), stopped)
                return 0
            with ZenohBus.open(options, RIG, clock, stopped) as bus:
                match role:
                    case "viewer":
                        id, rate = arguments
                        service = Service("viewer", id, id, lambda: 0, viewer_step)
                        return run(service, bus, clock, images(float(rate)), stopped)
                    case "integrator":
                        (path,) = arguments
                        topics = (TopicSubscription(SIGHTING), TopicSubscription(PARTIAL_BDP))
                        recorder = Log(bus.reader(), Recording(Path(path), rig=RIG, start_ns=clock.now_ns()))
                        recorder.start()
                        try:
                            answering: Service[None, int, Image] = Service(
                                "integrator", "main", None, lambda: 0, integrator_step, topics, keeps_time=True
                            )
                            return run(answering, bus, clock, stopped=stopped, extra_counts=recorder.counts)
                        finally:
                            recorder.close()
        except BusError as error:
            print(error, file=sys.stderr)
            return 1
    return 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
