"""Cost of the messages on the network: codec and recording."""

from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.rig_process import RIG
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import decode, encode
from zenocap.common.recording.writer import Recording
from zenocap.common.topics import topic_of

ANGLES = {f"{joint}.{axis}": 0.1 for joint in ("neck", "shoulder", "elbow", "hip", "knee", "navel") for axis in "xyz"}
BAP = m.UniversalBap(
    frame=1,
    captured_ns=10**18,
    position=(0.0, 1.0, 0.0),
    angles=ANGLES,
    scores={"1": 0.7, "2": 0.6},
    views={"1": "facade", "2": "flank"},
    stale=[],
    lost=[],
)
SIGHTING_MESSAGE = m.Sighting(
    frame=1,
    captured_ns=10**18,
    viewer="1",
    present=True,
    x=0.1,
    y=0.2,
    height=1.0,
    width=0.3,
    view="facade",
    score=0.5,
)
MASK = m.Silhouette(
    frame=1, captured_ns=10**18, viewer="1", size=(640, 480), region=(0, 0, 640, 480), data=bytes(range(256)) * 80
)


@pytest.mark.parametrize("message", [SIGHTING_MESSAGE, BAP, MASK], ids=lambda message: type(message).__name__)
def test_encode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert len(benchmark(encode, message)) > 50


@pytest.mark.parametrize("message", [SIGHTING_MESSAGE, BAP, MASK], ids=lambda message: type(message).__name__)
def test_decode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert benchmark(decode, encode(message), type(message)) == message


def envelopes(count: int) -> list[Envelope]:
    """The mixture of a rig at 50 us intervals (the budget is 20 000 per second), each with its bytes."""
    made = []
    for index in range(count):
        message = (SIGHTING_MESSAGE, BAP, MASK)[index % 3]
        topic = topic_of(type(message))
        key = topic.at(RIG, **topic.names_of(message))
        made.append(Envelope(key, topic, message, 10**18 + index * 50_000, encode(message)))
    return made


def test_record_1000_messages(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    mix = envelopes(1000)

    def record() -> int:
        recording = Recording(tmp_path / "take.mcap", rig=RIG, start_ns=0, overwrite=True)
        for envelope in mix:
            recording.record(envelope)
        return recording.close().messages

    assert benchmark.pedantic(record, rounds=10) == 1000
