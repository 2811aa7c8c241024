"""The observing host: all messages of a rig to standard output, one JSON line each.

python -m benchmarks.faults.observer RIG_NAME ENDPOINT
"""

import sys

import msgspec

from benchmarks.faults.measures import ReceivedMessage
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.runtime import logs
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.topics import (
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

TOPICS = (SIGHTING, SILHOUETTE, PARTIAL_BAP, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_POSE, POSTURE, HEALTH)


def received_message(event: Envelope | Alive) -> ReceivedMessage:
    """The parts of an event that the figures need."""
    if isinstance(event, Alive):
        sender = f"{event.service} {event.id}"
        return ReceivedMessage(event.received_ns, "joined" if event.alive else "left", sender, 0, event.received_ns)
    message = event.message
    missing_viewers: tuple[str, ...] = ()
    state_text = ""
    match message:
        case m.UniversalBap(stale=stale):
            missing_viewers = tuple(stale)
        case m.TrackerPose(views=views, lost=lost):
            missing_viewers = () if not lost else ("lost",)
            state_text = " ".join(views)
        case m.Health(state=state):
            state_text = state
        case _:
            pass
    service, id = service_at(event.key) or ("", "")
    return ReceivedMessage(
        event.received_ns,
        event.topic.name,
        f"{service} {id}",
        message.frame,
        message.captured_ns,
        missing_viewers,
        state_text,
    )


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
                sys.stdout.buffer.write(msgspec.json.encode(received_message(event)) + b"\n")
                sys.stdout.buffer.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
