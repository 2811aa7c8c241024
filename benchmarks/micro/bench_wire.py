"""Cost of the messages on the network.  `make benchmark` times codec and recording; `python -m benchmarks.micro.bench_wire`
measures latencies between processes: a viewer at 60 Hz, router, integrator, and this process, over loopback.
"""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.rig_process import RIG
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.codec import decode, encode
from zenocap.common.recording.log import Log
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import ASSIGNMENT, SIGHTING, UNIVERSAL_BAP, topic_of

REPOSITORY = Path(__file__).parents[2]
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


def percentiles(values_ms: list[float]) -> dict[str, float]:
    ordered = sorted(values_ms)
    picks = {"p50": 0.5, "p99": 0.99, "max": 1.0}
    return {name: round(ordered[min(len(ordered) - 1, int(share * len(ordered)))], 3) for name, share in picks.items()}


def measure(seconds: float, rate: float) -> dict[str, object]:
    """Latencies (ms) from the capture time of a frame, through its viewer's loop, to `receive` in this process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    one_way: list[float] = []
    round_trip: list[float] = []
    with TemporaryDirectory() as folder:
        roles = (["router"], ["integrator", f"{folder}/take.mcap"], ["viewer", "1", str(rate)])
        processes = [
            subprocess.Popen(
                [sys.executable, "-m", "tests.support.rig_process", role[0], endpoint, *role[1:]],
                cwd=REPOSITORY,
                stderr=subprocess.DEVNULL,
            )
            for role in roles
        ]
        try:
            options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
            with ZenohBus.open(options, RIG, RealClock()) as bus:
                bus.subscribe(SIGHTING)
                bus.subscribe(ASSIGNMENT)
                end_s = time.monotonic() + 2.0 + seconds
                while (now_s := time.monotonic()) < end_s:
                    event = bus.receive(0.1)
                    if isinstance(event, Envelope) and now_s > end_s - seconds:
                        late_ms = (time.time_ns() - event.message.captured_ns) / 1e6
                        (one_way if event.topic is SIGHTING else round_trip).append(late_ms)
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait()
    return {
        "rate_hz": rate,
        "sightings": len(one_way),
        "frame_to_sighting_received_ms": percentiles(one_way),
        "assignments": len(round_trip),
        "frame_to_sighting_to_assignment_received_ms": percentiles(round_trip),
    }


def recording_rate(count: int) -> dict[str, object]:
    mixes = {
        "small": [envelope for envelope in envelopes(count * 3) if envelope.topic is UNIVERSAL_BAP],
        "mix with 20 KB silhouettes": envelopes(count),
    }
    rates: dict[str, object] = {}
    for name, mix in mixes.items():
        with TemporaryDirectory() as folder:
            recording = Recording(Path(folder) / "take.mcap", rig=RIG, start_ns=0)
            started_s = time.perf_counter()
            for envelope in mix:
                recording.record(envelope)
            recording.close()
            rates[f"recorded_per_s, {name}"] = round(len(mix) / (time.perf_counter() - started_s))
            rates[f"logged_per_s, {name}"] = log_rate(mix, Path(folder) / "log.mcap")
    return rates


def log_rate(mix: list[Envelope], path: Path) -> int:
    """Messages per second from the queue of the bus, decoded, through the log's thread to the disk."""
    network = LocalNetwork(RIG, RealClock())
    bus = network.bus()
    log = Log(bus.reader(), Recording(path, rig=RIG, start_ns=0))
    log.start()
    started_s = time.perf_counter()
    for number, envelope in enumerate(mix):
        for other in network.buses:
            other.deliver(envelope.key, envelope.data)
        if number % 1000 == 0:
            while log.statistics.messages < number - 1000:
                time.sleep(0.001)
    end = log.close()
    assert (end.messages, end.lost) == (len(mix), 0)
    return round(len(mix) / (time.perf_counter() - started_s))


if __name__ == "__main__":
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    print(json.dumps(recording_rate(20_000) | measure(seconds, 60.0), indent=2))
