"""A host that listens: everything said on a rig, one JSON line each, to standard output.

python -m tests.evaluation.faults.observer RIG_NAME ENDPOINT
"""

import sys

import msgspec

from common import messages as m
from common.bus.protocol import Alive, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime import logs
from common.runtime.clock import RealClock
from common.runtime.signals import stop_signals
from common.topics import (
    HEALTH,
    PARTIAL_BAP,
    POSTURE,
    SIGHTING,
    SILHOUETTE,
    TRACKER_POSE,
    UNIVERSAL_BAP,
    UNIVERSAL_BDP,
    service_at,
)
from tests.evaluation.faults.measures import Heard

TOPICS = (SIGHTING, SILHOUETTE, PARTIAL_BAP, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_POSE, POSTURE, HEALTH)


def heard(event: Envelope | Alive) -> Heard:
    """What of an event is measured."""
    if isinstance(event, Alive):
        who = f"{event.service} {event.id}"
        return Heard(event.received_ns, "came" if event.alive else "went", who, 0, event.received_ns)
    message = event.message
    without: tuple[str, ...] = ()
    words = ""
    match message:
        case m.UniversalBap(stale=stale):
            without = tuple(stale)
        case m.TrackerPose(views=views, lost=lost):
            without = () if not lost else ("lost",)
            words = " ".join(views)
        case m.Health(state=state):
            words = state
        case _:
            pass
    service, id = service_at(event.key) or ("", "")
    return Heard(event.received_ns, event.topic.name, f"{service} {id}", message.frame, message.captured_ns, without, words)


def main(rig: str, endpoint: str) -> None:
    logs.configure("observer")
    options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig, RealClock(), stopped) as bus:
        for topic in TOPICS:
            bus.subscribe(topic, every=True)
        bus.watch_alive()
        while not stopped():
            event = bus.receive(0.1)
            if isinstance(event, Envelope | Alive):
                sys.stdout.buffer.write(msgspec.json.encode(heard(event)) + b"\n")
                sys.stdout.buffer.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
