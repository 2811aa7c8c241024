"""Small takes for tests of the replay: two viewers and an integrator at 100 Hz."""

from collections.abc import Iterable
from pathlib import Path

from tests.support.rig_process import assignment, bdp, sighting
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode
from zenocap.common.recording.writer import Recording
from zenocap.common.topics import topic_of

START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 10_000_000
RIG = "demo"


def envelope(message: m.Message, log_ns: int) -> Envelope:
    topic = topic_of(type(message))
    return Envelope(topic.at(RIG, **topic.names_of(message)), topic, message, log_ns, encode(message))


def sample_messages(frames: int, start_ns: int = START_NS) -> list[Envelope]:
    """With every frame two sightings, 1 and 2 ms after capture, and an assignment; with frame 0 also both BDPs."""
    found = []
    for frame in range(frames):
        at_ns = start_ns + frame * PERIOD_NS
        for number, viewer in enumerate(("1", "2"), start=1):
            if not frame:
                found.append(envelope(bdp(viewer), at_ns + number * 1_000_000))
            found.append(envelope(sighting(viewer, frame, at_ns), at_ns + number * 1_000_000))
        found.append(envelope(assignment(found[-1]), at_ns + 3_000_000))
    return found


def written(path: Path, envelopes: Iterable[Envelope], *, flush_every: int = 0) -> Path:
    """flush_every: messages per chunk; 0 for the default."""
    recording = Recording(path, rig=RIG, start_ns=START_NS, overwrite=True)
    for number, each in enumerate(envelopes, start=1):
        recording.record(each)
        if flush_every and number % flush_every == 0:
            recording.flush()
    recording.close()
    return path
