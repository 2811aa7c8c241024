"""Open pages beside a rig of stand-ins: they are opened and closed while it runs, so that conditions are paired.

All pages are of one animator, as in a rig; a process reads them as a browser does, without drawing.
"""

import asyncio
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import mean, median

import msgspec
import numpy as np
from benchmarks.sections import Row, Section, Table
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from benchmarks.load.bench import Bench
from benchmarks.load.readers import CHANGED_S, ROUNDS, SETTLE_S, Phase, measured_phase
from zenocap.common.runtime.priority import NICENESS
from zenocap.tools.launcher.peer_mesh import free_ports
from zenocap.tools.load_test.launch import LoadProcesses
from zenocap.tools.load_test.measurement import running
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.load_test.processes import ProcessKey

PLAN = Plan(stand_ins=True)
PAGES = (0, 1, 16)
ANIMATOR: ProcessKey = ("load-1", "animator", "main")
COLUMNS = (
    "pages", "pose p50 ms", "p99 ms, median", "p99 ms, of each round", "lost %", "seen by a page: p50, p99 ms",
    "animator's cores", "others' cores",
)  # fmt: skip


@dataclass(frozen=True)
class Seen:
    """One phase: latency of the poses on the bus, and until a page has parsed them (ms)."""

    phase: Phase
    pages_ms: tuple[float, ...]


def pages(bench: Bench) -> Section:
    """Latency of the poses by the number of open pages.  None: the animator runs without a page."""
    found: dict[int, list[Seen]] = {count: [] for count in PAGES}
    deployment = bench.session.deployment(PLAN, lambda *_: None)
    with (
        running(PLAN, deployment, bench.stopped, lambda *_: None) as (processes, subscriber, epoch_ns),
        animator(deployment.rigs[0], processes) as (port, pid),
        browser(port) as parent,
    ):
        subscriber.receive_for(SETTLE_S)
        for number in range(ROUNDS):
            for count in PAGES if number % 2 == 0 else reversed(PAGES):
                if bench.stopped():
                    break
                ask(parent, count)
                subscriber.receive_for(CHANGED_S)
                ask(parent, count)  # forgets what was seen until now
                phase = measured_phase(PLAN, bench.seconds, processes, subscriber, epoch_ns, {ANIMATOR: pid})
                found[count].append(Seen(phase, tuple(ask(parent, count))))
                print(f"round {number + 1}, {count} pages: {phase}", flush=True)  # a run takes long, and may be ended
    rows = tuple(row(count, seen) for count, seen in found.items() if seen)
    notes = (
        f"One rig of two stand-ins at 30 frames/s; pages are opened and closed every {bench.seconds:g} s, {ROUNDS} rounds.",
    )
    return Section("pages", "Open pages", notes, (Table("Pages", COLUMNS, rows),))


def row(count: int, found: list[Seen]) -> Row:
    phases = [one.phase for one in found]
    latencies = [ms for one in found for ms in one.pages_ms]
    seen = ", ".join(f"{ms:.0f}" for ms in np.percentile(latencies, [50, 99])) if latencies else "-"
    return (
        str(count), median(one.p50 for one in phases), median(one.p99 for one in phases),
        ", ".join(f"{one.p99:.0f}" for one in phases), 100 * mean(one.loss for one in phases), seen,
        f"{mean(one.readers for one in phases):.2f}", f"{mean(one.used.others for one in phases):.2f}",
    )  # fmt: skip


@contextmanager
def animator(rig: Path, processes: LoadProcesses) -> Iterator[tuple[int, int]]:
    """An animator of the rig, with the priority that it has under the launcher; yields its port and process id."""
    port = free_ports(1)[0]
    command = [
        sys.executable, "-P", "-m", "zenocap", "animator", str(rig), "--port", str(port), "--mode", "client",
        *(word for endpoint in processes.own.connect for word in ("--connect", endpoint)), "--no-multicast-scouting",
    ]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        asyncio.run(opened(port))
        yield port, process.pid
    finally:
        process.terminate()
        process.wait(20)


async def opened(port: int, within_s: float = 60.0) -> None:
    """Wait until a page can be opened.  Raises TimeoutError."""
    async with asyncio.timeout(within_s):
        while True:
            with suppress(OSError):
                async with connect(address(port)):
                    return
            await asyncio.sleep(0.1)


@contextmanager
def browser(port: int) -> Iterator[Connection]:
    """A process that opens pages; asked for a number of them, it answers with the latencies seen since the last time."""
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=read_pages, args=(port, there), daemon=True)
    process.start()
    try:
        yield here
    finally:
        process.terminate()
        process.join(10)


def ask(parent: Connection, count: int) -> list[float]:
    parent.send(count)
    answer: list[float] = parent.recv()
    return answer


def read_pages(port: int, parent: Connection) -> None:
    os.nice(NICENESS)  # browsers are on other machines
    asyncio.run(_read_pages(port, parent))


async def _read_pages(port: int, parent: Connection) -> None:
    loop = asyncio.get_running_loop()
    readers: list[tuple[ClientConnection, asyncio.Task[None]]] = []
    latencies: list[float] = []
    while True:
        count: int = await loop.run_in_executor(None, parent.recv)
        while len(readers) > count:
            connection, task = readers.pop()
            task.cancel()
            await connection.close()
        while len(readers) < count:
            connection = await connect(address(port), compression=None, max_size=None)
            readers.append((connection, asyncio.create_task(_read(connection, latencies))))
        parent.send(list(latencies))
        latencies.clear()


async def _read(connection: ClientConnection, latencies: list[float]) -> None:
    with suppress(ConnectionClosed):
        async for text in connection:
            for update in msgspec.json.decode(text):
                if update["type"] == "pose":
                    latencies.append(time.time() * 1e3 - update["captured_ms"])
            await connection.send('{"type":"acknowledge"}')


def address(port: int) -> str:
    return f"ws://127.0.0.1:{port}/socket"
