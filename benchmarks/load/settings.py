"""Zenoh settings: each against its alternatives, with recorded messages through a router.

*Zenoh* marks Zenoh's default; *ours* the setting of `common/bus`.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from benchmarks.sections import Row, Section, Table

from benchmarks.load.bench import Bench
from benchmarks.load.player import Play
from benchmarks.load.trials import PlayerResult, endpoint, player, result_of, router, trial

SHARED = Path("/dev/shm")
LEASE, RETRY = "transport/link/tx/lease", "connect/retry"
QUEUE, SHM = "transport/link/tx/queue/size/data", "transport/shared_memory/enabled"
WAIT = "transport/link/tx/queue/congestion_control/drop/wait_before_drop"


def settings(bench: Bench) -> Section:
    """All tables.  Each trial takes several seconds."""
    seconds = min(bench.seconds, 10.0)
    tables = (_express(seconds), _queue(seconds), _control(), _reading(seconds), _lease(), _reconnect(), _shared(seconds))
    notes = (
        "One publisher sends the messages of a frame set for all its viewers on a schedule; times are from the scheduled "
        "time to the end of decoding at the subscriber. All processes are on one machine, around a router.",
    )
    return Section("settings", "Zenoh's settings", notes, tables)


def _latency(arrivals: PlayerResult) -> tuple[float, ...]:
    return tuple(arrivals.get(name, float("nan")) for name in ("p50", "p99", "p99.9", "max"))


def _express(seconds: float) -> Table:
    rows: list[Row] = []
    for rate, burst in ((30.0, 2), (120.0, 2), (60.0, 16)):
        for express in (False, True):
            sent, arrivals = trial(Play(endpoint(), seconds=seconds, rate=rate, burst=burst, express=express))
            name = f"{burst} viewers, {rate:g}/s, {'express (ours)' if express else 'batched (Zenoh)'}"
            rows.append((name, *_latency(arrivals), int(sent["sent"] - arrivals["received"])))
    return Table("Express or batched", ("what", "p50 ms", "p99", "p99.9", "max", "lost"), tuple(rows))


def _queue(seconds: float) -> Table:
    rows: list[Row] = []
    for config, name in (
        ({QUEUE: "2", WAIT: "1000"}, "2 messages, 1 ms (Zenoh)"),
        ({QUEUE: "4", WAIT: "1000"}, "4 messages, 1 ms"),
        ({QUEUE: "16", WAIT: "1000"}, "16 messages, 1 ms (ours)"),
        ({QUEUE: "16", WAIT: "5000"}, "16 messages, 5 ms"),
    ):
        play = Play(endpoint(), config, seconds=seconds, rate=60.0, burst=32)
        sent, arrivals = trial(play)
        lost = int(sent["sent"] - arrivals["received"])
        rows.append((name, *_latency(arrivals), lost, int(sent["sent"]), sent["longest_put_ms"]))
    return Table(
        "Length of the sending queue, and waiting time of a publisher; 32 messages per frame set, 60/s",
        ("what", "p50 ms", "p99", "p99.9", "max", "lost", "of", "longest put ms"),
        tuple(rows),
    )


def _control() -> Table:
    """Effect on the other subscriber and on the publisher when one of two subscribers is frozen for 4 s."""
    rows: list[Row] = []
    for peers in (False, True):
        for control, config, name in (
            ("block", {}, "wait for space (BLOCK)"),
            ("drop", {}, "drop after 1 ms (ours, and Zenoh)"),
            ("drop", {WAIT: "5000"}, "drop after 5 ms"),
        ):
            play = Play(endpoint(), config, seconds=8.0, rate=60.0, burst=2, size=20_000, control=control, peers=peers)
            rows.append((f"{'peers' if peers else 'router'}: {name}", *_frozen(play)))
    columns = (
        "what", "lost by the other", "its longest gap s", "its p99 ms", "longest put ms", "oldest of the frozen one ms",
    )  # fmt: skip
    return Table("A subscriber frozen for 4 s; 20 kB, 120 messages/s", columns, tuple(rows))


def _frozen(play: Play) -> tuple[float, ...]:
    with ExitStack() as stack:
        if not play.peers:
            stack.enter_context(router(play.endpoint))
        healthy, frozen = (stack.enter_context(player("sub", play)) for _ in range(2))
        publisher = stack.enter_context(player("pub", play))
        time.sleep(2.0)
        os.kill(frozen.pid, signal.SIGSTOP)
        time.sleep(4.0)
        os.kill(frozen.pid, signal.SIGCONT)
        sent = result_of(publisher, stop=False)
        arrivals, late = result_of(healthy), result_of(frozen)
    lost = int(sent["sent"] - arrivals["received"])
    p99 = arrivals.get("p99", float("nan"))
    return lost, arrivals["longest_gap_s"], p99, sent["longest_put_ms"], late.get("max", float("nan"))


def _reading(seconds: float) -> Table:
    rows: list[Row] = []
    for reading, name in (
        ("fifo", "FifoChannel(256)"), ("ring", "RingChannel(1), all keys"), ("callback", "callback into the inbox (ours)")
    ):  # fmt: skip
        for handle_ms in (0.0, 20.0):
            play = Play(endpoint(), seconds=seconds, rate=60.0, burst=2)
            reader = Play(play.endpoint, reading=reading, handle_ms=handle_ms)
            _, arrivals = trial(play, reader)
            rows.append(
                (
                    f"{name}, {handle_ms:g} ms for each",
                    *_latency(arrivals)[:2],
                    arrivals.get("max", float("nan")),
                    int(arrivals["received"]),
                )
            )
    return Table(
        "Receiving; two viewers at 60/s: age of handled messages", ("what", "p50 ms", "p99", "max", "handled"), tuple(rows)
    )


def _lease() -> Table:
    """Time to detect a frozen publisher, and false alarms for a live one on a busy machine."""
    rows: list[Row] = []
    for lease, name in (("10000", "10 s (Zenoh)"), ("2000", "2 s (ours)"), ("1000", "1 s"), ("500", "0.5 s")):
        play = Play(endpoint(), {LEASE: lease}, seconds=30.0, rate=30.0)
        # A lease is announced by the sender and applied by the receiver.
        with router(play.endpoint), player("sub", play) as subscriber, player("pub", play) as publisher:
            time.sleep(1.0)
            os.kill(publisher.pid, signal.SIGSTOP)
            frozen_s = time.time()
            time.sleep(int(lease) / 1e3 * 1.4 + 0.5)
            result = result_of(subscriber)
            os.kill(publisher.pid, signal.SIGCONT)
        after_s = result["gone_at_s"] - frozen_s if result["gone"] else float("nan")
        rows.append((name, after_s, _false_alarms(Play(endpoint(), {LEASE: lease}, seconds=60.0, rate=30.0))))
    return Table("Lease", ("what", "frozen: detected after s", "false alarms in 8 s, 8 busy programs"), tuple(rows))


def _false_alarms(play: Play) -> int:
    with ExitStack() as stack:
        stack.enter_context(router(play.endpoint))
        subscriber = stack.enter_context(player("sub", play))
        publisher = stack.enter_context(player("pub", play))
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(8)]
        try:
            time.sleep(8.0)
        finally:
            for process in busy:
                process.kill()
                process.wait()
        found = result_of(subscriber)
        result_of(publisher)
    return int(found["gone"])


def _reconnect() -> Table:
    """Time to the next message after the router is killed and started again a second later."""
    period = '{"period_init_ms": %d, "period_max_ms": %d, "period_increase_factor": %g}'
    rows: list[Row] = []
    for config, name in (
        ({RETRY: period % (1000, 4000, 2)}, "1 s, to 4 s (Zenoh)"),
        ({}, "0.1 s, to 0.5 s (ours)"),
        ({RETRY: period % (50, 200, 1.5)}, "0.05 s, to 0.2 s"),
    ):
        times = [_reconnect_time(Play(endpoint(), config, seconds=12.0, rate=60.0)) for _ in range(3)]
        rows.append((name, *sorted(times)))
    return Table("Router gone for 1 s: first message after its return, s", ("what", "best", "median", "worst"), tuple(rows))


def _reconnect_time(play: Play) -> float:
    with ExitStack() as stack:
        with router(play.endpoint) as first:
            subscriber = stack.enter_context(player("sub", play))
            stack.enter_context(player("pub", play))
            time.sleep(1.0)
            first.kill()
            first.wait()
            killed_s = time.time()
            time.sleep(1.0)
        with router(play.endpoint):
            down_s = time.time() - killed_s
            time.sleep(6.5)
            arrivals = result_of(subscriber)
    reconnected = arrivals["last_s"] > killed_s + down_s
    return arrivals["longest_gap_s"] - down_s if reconnected else float("nan")


def _shared(seconds: float) -> Table:
    rows: list[Row] = []
    for size, what in ((400, "silhouettes of 400 B"), (20_000, "previews of 20 kB")):
        for on, name in (("true", "on (Zenoh)"), ("false", "off (ours)")):
            before = _files()
            play = Play(endpoint(), {SHM: on}, seconds=seconds, rate=60.0, burst=4, size=size)
            sent, arrivals = trial(play)
            rows.append(
                (
                    f"{what}, {name}",
                    *_latency(arrivals)[:3],
                    int(sent["sent"] - arrivals["received"]),
                    _left_in_shared_memory(play, before),
                )
            )
    return Table("Shared memory", ("what", "p50 ms", "p99", "p99.9", "lost", "MB left behind by kill -9"), tuple(rows))


def _left_in_shared_memory(play: Play, before: Mapping[str, int]) -> float:
    with router(play.endpoint), player("sub", play) as subscriber, player("pub", play) as publisher:
        time.sleep(2.0)
        for process in (publisher, subscriber):
            process.kill()
            process.wait()
    time.sleep(0.5)
    return sum(size for name, size in _files().items() if name not in before) / 1e6


def _files() -> dict[str, int]:
    """Zenoh's files in shared memory, with sizes (bytes)."""
    return {path.name: path.stat().st_size for path in SHARED.glob("*.zenoh")} if SHARED.is_dir() else {}
