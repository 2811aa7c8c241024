"""A publisher or subscriber of recorded messages with given Zenoh settings: python -m benchmarks.load.player ROLE JSON

Prints one JSON object at the end: of a publisher the number of messages and the longest put, of a subscriber the
received messages and their times.
"""

import logging
import sys
import time
from collections.abc import Callable, Mapping

import msgspec
import numpy as np
import zenoh
from zenoh import Sample
from zenoh.handlers import FifoChannel, RingChannel

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration
from zenocap.common.messages import Silhouette
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.topics import ALIVE, SILHOUETTE

RIG = "settings"
ALIVE_KEY = ALIVE.format(rig=RIG, service="player", id="1")
CONTROL = {"drop": zenoh.CongestionControl.DROP, "block": zenoh.CongestionControl.BLOCK}


class Play(msgspec.Struct, frozen=True):
    """config: keys of Zenoh's configuration with JSON5 values that replace ours.

    burst: messages per frame set, one for each viewer.  size: bytes of each mask.
    reading: callback (into the bus's inbox), ring or fifo (Zenoh's own channels).
    handle_ms: handling time per message.  peers: without a router; the publisher listens at the endpoint.
    """

    endpoint: str
    config: Mapping[str, str] = {}
    seconds: float = 5.0
    rate: float = 30.0
    burst: int = 2
    size: int = 400
    express: bool = True
    control: str = "drop"
    reading: str = "callback"
    handle_ms: float = 0.0
    peers: bool = False


def opened(play: Play, *, listens: bool = False) -> zenoh.Session:
    place = (play.endpoint,)
    options = ZenohOptions("client", place, multicast_scouting=False)
    if play.peers:
        options = ZenohOptions("peer", () if listens else place, place if listens else (), multicast_scouting=False)
    config = configuration(options)
    for key, value in play.config.items():
        config.insert_json5(key, value)
    return zenoh.open(config)


def publish(play: Play, stopped: Callable[[], bool]) -> dict[str, float]:
    """Publish on a schedule; each message carries its scheduled time."""
    data = np.random.default_rng(0).bytes(play.size)
    longest_s, sent = 0.0, 0
    with opened(play, listens=True) as session:
        names = [str(number) for number in range(1, play.burst + 1)]
        publishers = {
            name: session.declare_publisher(
                SILHOUETTE.at(RIG, viewer=name), congestion_control=CONTROL[play.control], express=play.express
            )
            for name in names
        }
        token = session.liveliness().declare_token(ALIVE_KEY)
        time.sleep(0.5)
        print("ready", flush=True)
        start_ns = time.time_ns()
        for frame in range(int(play.seconds * play.rate)):
            due_ns = start_ns + round(frame * 1e9 / play.rate)
            time.sleep(max(0.0, (due_ns - time.time_ns()) / 1e9))
            if stopped():
                break
            for name, publisher in publishers.items():
                message = Silhouette(
                    frame=frame, captured_ns=due_ns, viewer=name, size=(640, 480), region=(0, 0, 640, 480), data=data
                )
                put_start_s = time.perf_counter()
                publisher.put(codec.encode(message))
                longest_s, sent = max(longest_s, time.perf_counter() - put_start_s), sent + 1
        time.sleep(0.5)
        token.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
    return {"sent": sent, "longest_put_ms": 1e3 * longest_s}


def subscribe(play: Play, stopped: Callable[[], bool]) -> dict[str, float]:
    """Subscribe until stopped; latency from the scheduled time to the end of handling."""
    latencies: list[float] = []
    times: list[float] = []
    departures: list[float] = []

    def handle(data: bytes) -> None:
        message = codec.decode(data, Silhouette)
        times.append(time.time())
        latencies.append((time.time_ns() - message.captured_ns) / 1e6)
        time.sleep(play.handle_ms / 1e3)

    def on_liveliness(sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            departures.append(time.time())

    def run_subscriber(session: zenoh.Session) -> None:
        session.liveliness().declare_subscriber(ALIVE_KEY, on_liveliness)
        expression = SILHOUETTE.on(RIG)
        print("ready", flush=True)
        if play.reading == "callback":
            inbox = Inbox(logging.getLogger(__name__))
            session.declare_subscriber(
                expression,
                lambda s: inbox.put(
                    str(s.key_expr), SILHOUETTE, s.payload.to_bytes(), time.time_ns(), every=play.handle_ms == 0
                ),
            )
            while not stopped():
                event = inbox.take(0.1)
                if isinstance(event, Envelope):
                    handle(event.data)
        else:
            channel: RingChannel[Sample] | FifoChannel[Sample] = (
                RingChannel(1) if play.reading == "ring" else FifoChannel(256)
            )
            subscriber = session.declare_subscriber(expression, channel)
            while not stopped():
                sample = subscriber.try_recv()
                if sample is None:
                    time.sleep(0.0005)
                else:
                    handle(sample.payload.to_bytes())

    session = opened(play)
    try:
        with session:
            run_subscriber(session)
    except zenoh.ZError as error:  # a session with a full FIFO cannot be closed in time
        print(f"not closed: {error}", file=sys.stderr)
    liveliness = {"gone": len(departures), "gone_at_s": departures[0] if departures else 0.0}
    if not latencies:
        return {"received": 0, "longest_gap_s": 0.0, "last_s": 0.0, **liveliness}
    p50, p99, p999 = np.percentile(latencies, (50, 99, 99.9))
    gap = float(np.max(np.diff(times))) if len(times) > 1 else 0.0
    return {
        "received": len(latencies), "p50": float(p50), "p99": float(p99), "p99.9": float(p999), "max": max(latencies),
        "longest_gap_s": gap, "last_s": times[-1], **liveliness,
    }  # fmt: skip


def main(role: str, text: str) -> None:
    play = msgspec.json.decode(text, type=Play)
    with stop_signals() as stopped:
        result = (publish if role == "pub" else subscribe)(play, stopped)
    print(msgspec.json.encode(result).decode(), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
