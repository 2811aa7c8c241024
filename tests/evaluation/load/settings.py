"""Zenoh's settings before and after: each against its alternatives, on real messages through a router.

Before is what Zenoh does by itself; *ours* is what `common/bus` sets.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from tests.evaluation.load.bench import Bench
from tests.evaluation.load.player import Play
from tests.evaluation.load.trials import Answer, answered, endpoint, player, router, trial
from tests.evaluation.sections import Row, Section, Table

SHARED = Path("/dev/shm")
LEASE, RETRY = "transport/link/tx/lease", "connect/retry"
QUEUE, SHM = "transport/link/tx/queue/size/data", "transport/shared_memory/enabled"
WAIT = "transport/link/tx/queue/congestion_control/drop/wait_before_drop"


def settings(bench: Bench) -> Section:
    """Every table.  Each trial takes some seconds."""
    seconds = min(bench.seconds, 10.0)
    tables = (_express(seconds), _queue(seconds), _control(), _reading(seconds), _lease(), _reconnect(), _shared(seconds))
    notes = (
        "One publisher says an instant's messages for all its viewers, by a schedule; times are from when they were due "
        "until they were decoded at the subscriber. All processes are on one machine, around a router.",
    )
    return Section("settings", "Zenoh's settings", notes, tables)


def _latency(heard: Answer) -> tuple[float, ...]:
    return tuple(heard.get(name, float("nan")) for name in ("p50", "p99", "p99.9", "max"))


def _express(seconds: float) -> Table:
    rows: list[Row] = []
    for rate, burst in ((30.0, 2), (120.0, 2), (60.0, 16)):
        for express in (False, True):
            sent, heard = trial(Play(endpoint(), seconds=seconds, rate=rate, burst=burst, express=express))
            name = f"{burst} viewers, {rate:g}/s, {'express (ours)' if express else 'batched (Zenoh)'}"
            rows.append((name, *_latency(heard), int(sent["sent"] - heard["received"])))
    return Table("Sending at once or batched", ("what", "p50 ms", "p99", "p99.9", "max", "lost"), tuple(rows))


def _queue(seconds: float) -> Table:
    rows: list[Row] = []
    for config, name in (
        ({QUEUE: "2", WAIT: "1000"}, "2 places, 1 ms (Zenoh)"),
        ({QUEUE: "4", WAIT: "1000"}, "4 places, 1 ms"),
        ({QUEUE: "16", WAIT: "1000"}, "16 places, 1 ms (ours)"),
        ({QUEUE: "16", WAIT: "5000"}, "16 places, 5 ms"),
    ):
        play = Play(endpoint(), config, seconds=seconds, rate=60.0, burst=32)
        sent, heard = trial(play)
        lost = int(sent["sent"] - heard["received"])
        rows.append((name, *_latency(heard), lost, int(sent["sent"]), sent["longest_put_ms"]))
    return Table(
        "Places in the sending queue, and how long a publisher waits for one; 32 messages an instant, 60/s",
        ("what", "p50 ms", "p99", "p99.9", "max", "lost", "of", "longest put ms"),
        tuple(rows),
    )


def _control() -> Table:
    """One of two subscribers is frozen for 4 s; what of the other one, and of the publisher?"""
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
        "what", "the other one lost", "its longest gap s", "its p99 ms", "longest put ms", "oldest the frozen one got, ms",
    )  # fmt: skip
    return Table("A subscriber frozen for 4 s; 20 kB, 120 messages/s", columns, tuple(rows))


def _frozen(play: Play) -> tuple[float, ...]:
    with ExitStack() as stack:
        if not play.peers:
            stack.enter_context(router(play.endpoint))
        well, frozen = (stack.enter_context(player("sub", play)) for _ in range(2))
        saying = stack.enter_context(player("pub", play))
        time.sleep(2.0)
        os.kill(frozen.pid, signal.SIGSTOP)
        time.sleep(4.0)
        os.kill(frozen.pid, signal.SIGCONT)
        sent = answered(saying, stop=False)
        heard, late = answered(well), answered(frozen)
    lost = int(sent["sent"] - heard["received"])
    p99 = heard.get("p99", float("nan"))
    return lost, heard["longest_gap_s"], p99, sent["longest_put_ms"], late.get("max", float("nan"))


def _reading(seconds: float) -> Table:
    rows: list[Row] = []
    for reading, name in (
        ("fifo", "FifoChannel(256)"), ("ring", "RingChannel(1), all keys"), ("callback", "callback into the inbox (ours)")
    ):  # fmt: skip
        for handle_ms in (0.0, 20.0):
            play = Play(endpoint(), seconds=seconds, rate=60.0, burst=2)
            reader = Play(play.endpoint, reading=reading, handle_ms=handle_ms)
            _, heard = trial(play, reader)
            rows.append(
                (
                    f"{name}, {handle_ms:g} ms for each",
                    *_latency(heard)[:2],
                    heard.get("max", float("nan")),
                    int(heard["received"]),
                )
            )
    return Table(
        "Reading; two viewers at 60/s: age of what is handled", ("what", "p50 ms", "p99", "max", "handled"), tuple(rows)
    )


def _lease() -> Table:
    """How soon a frozen publisher is noticed, and how often a live one is taken for gone while the machine is busy."""
    rows: list[Row] = []
    for lease, name in (("10000", "10 s (Zenoh)"), ("2000", "2 s (ours)"), ("1000", "1 s"), ("500", "0.5 s")):
        play = Play(endpoint(), {LEASE: lease}, seconds=30.0, rate=30.0)
        # The router's own lease is for what it sends; who hears counts by the sender's.
        with router(play.endpoint), player("sub", play) as hearing, player("pub", play) as saying:
            time.sleep(1.0)
            os.kill(saying.pid, signal.SIGSTOP)
            frozen_s = time.time()
            time.sleep(int(lease) / 1e3 * 1.4 + 0.5)
            noticed = answered(hearing)
            os.kill(saying.pid, signal.SIGCONT)
        after_s = noticed["gone_at_s"] - frozen_s if noticed["gone"] else float("nan")
        rows.append((name, after_s, _alarms(Play(endpoint(), {LEASE: lease}, seconds=60.0, rate=30.0))))
    return Table("Lease", ("what", "frozen: noticed after s", "false alarms in 8 s, 8 busy programs"), tuple(rows))


def _alarms(play: Play) -> int:
    with ExitStack() as stack:
        stack.enter_context(router(play.endpoint))
        hearing = stack.enter_context(player("sub", play))
        saying = stack.enter_context(player("pub", play))
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(8)]
        try:
            time.sleep(8.0)
        finally:
            for process in busy:
                process.kill()
                process.wait()
        found = answered(hearing)
        answered(saying)
    return int(found["gone"])


def _reconnect() -> Table:
    """The router is killed, and started again a second later: when does the next message come?"""
    period = '{"period_init_ms": %d, "period_max_ms": %d, "period_increase_factor": %g}'
    rows: list[Row] = []
    for config, name in (
        ({RETRY: period % (1000, 4000, 2)}, "1 s, to 4 s (Zenoh)"),
        ({}, "0.1 s, to 0.5 s (ours)"),
        ({RETRY: period % (50, 200, 1.5)}, "0.05 s, to 0.2 s"),
    ):
        after = [_back(Play(endpoint(), config, seconds=12.0, rate=60.0)) for _ in range(3)]
        rows.append((name, *sorted(after)))
    return Table("Router gone for 1 s: first message after its return, s", ("what", "best", "median", "worst"), tuple(rows))


def _back(play: Play) -> float:
    with ExitStack() as stack:
        with router(play.endpoint) as first:
            hearing = stack.enter_context(player("sub", play))
            stack.enter_context(player("pub", play))
            time.sleep(1.0)
            first.kill()
            first.wait()
            killed_s = time.time()
            time.sleep(1.0)
        with router(play.endpoint):
            away_s = time.time() - killed_s
            time.sleep(6.5)
            heard = answered(hearing)
    came_back = heard["last_s"] > killed_s + away_s
    return heard["longest_gap_s"] - away_s if came_back else float("nan")


def _shared(seconds: float) -> Table:
    rows: list[Row] = []
    for size, what in ((400, "silhouettes of 400 B"), (20_000, "previews of 20 kB")):
        for on, name in (("true", "on (Zenoh)"), ("false", "off (ours)")):
            before = _files()
            play = Play(endpoint(), {SHM: on}, seconds=seconds, rate=60.0, burst=4, size=size)
            sent, heard = trial(play)
            rows.append(
                (f"{what}, {name}", *_latency(heard)[:3], int(sent["sent"] - heard["received"]), _left(play, before))
            )
    return Table("Shared memory", ("what", "p50 ms", "p99", "p99.9", "lost", "MB left behind by kill -9"), tuple(rows))


def _left(play: Play, before: Mapping[str, int]) -> float:
    with router(play.endpoint), player("sub", play) as hearing, player("pub", play) as saying:
        time.sleep(2.0)
        for process in (saying, hearing):
            process.kill()
            process.wait()
    time.sleep(0.5)
    return sum(size for name, size in _files().items() if name not in before) / 1e6


def _files() -> dict[str, int]:
    """Zenoh's files in shared memory, and their sizes."""
    return {path.name: path.stat().st_size for path in SHARED.glob("*.zenoh")} if SHARED.is_dir() else {}
