"""Latency, processor time and memory of the animator with a rig of 60 poses a second and several open pages.

This process publishes as the rig: two silhouettes and a universal BAP per frame set.  The animator is a separate process,
and so are the pages, which read everything; one more page never reads.  Latency is the time from before the BAP is
published until the page has parsed the pose, on one clock; in a real browser, until its scene is updated.
"""

import asyncio
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec
import numpy as np
from playwright.sync_api import sync_playwright
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from benchmarks.cases.speed.browser import CLOCK_TICKS, FLAGS
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from tests.support.animator_stand_in import assignment, bap, body_message, mask_of, pose_at, sighting, silhouette
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import Message
from zenocap.common.rig.rig import demo_rig, demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import topic_of
from zenocap.services.viewer.shell import camera_info
from zenocap.tools.launcher.peer_mesh import free_ports

FPS = 60
WARM_UP_S = 3.0  # before measuring


def run(one: Case) -> Figures:
    """One measurement.  Options: pages, chromium, seconds."""
    frame_sets, pages, seconds = walking_frame_sets(), one.option("pages", 1), one.option("seconds", 20.0)
    read = in_chromium if one.option("chromium", False) else read_pages
    with tempfile.TemporaryDirectory() as folder:
        running = Running(Path(folder))
        here, there = multiprocessing.Pipe()
        reader = multiprocessing.get_context("spawn").Process(target=read, args=(running.port, pages, there), daemon=True)
        reader.start()
        here.recv()  # all are open
        try:
            publish(running.bus, frame_sets, WARM_UP_S)
            here.send("measure")
            before_s, before_mb, started_s = running.cpu_s(), running.memory_mb(), time.monotonic()
            publish(running.bus, frame_sets, seconds)
            share = 100 * (running.cpu_s() - before_s) / (time.monotonic() - started_s)
            here.send("end")
            latencies = here.recv()
            memory_mb = running.memory_mb()
        finally:
            reader.terminate()
            running.close()
    seen = dict(zip(("p50", "p99"), map(float, np.percentile(latencies, [50, 99])), strict=True)) if latencies else {}
    received = {"poses seen": 100 * len(latencies) / (round(seconds * FPS) * max(1, pages))} if latencies else {}
    return {**seen, **received, "processor": share, "memory": memory_mb, "growth": memory_mb - before_mb}


def walking_frame_sets() -> list[list[Message]]:
    """Messages of one second of walking, by frame set."""
    found: list[list[Message]] = []
    for k in range(FPS):
        pose = pose_at(k / FPS)
        masks = [silhouette(viewer.id, k, 0, mask_of(viewer.camera, pose)) for viewer in demo_rig("two-view").viewers]
        sightings = [sighting(viewer.id, k, 0) for viewer in demo_rig("two-view").viewers]
        found.append([*masks, *sightings, assignment(k, 0, pose), bap(k, 0, pose)])
    return found


class Running:
    """The animator's process, and a bus to publish to it."""

    def __init__(self, folder: Path) -> None:
        self.port, net = free_ports(2)
        command = [
            sys.executable, "-P", "-m", "zenocap", "animator", str(demo_rig_file("two-view")), "--port", str(self.port),
            "--no-multicast-scouting", "-l", f"tcp/127.0.0.1:{net}", "--recordings", str(folder),
        ]  # fmt: skip
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        options = ZenohOptions("peer", (f"tcp/127.0.0.1:{net}",), multicast_scouting=False)
        self.bus = ZenohBus.open(options, "demo", RealClock())
        asyncio.run(self._ready())

    async def _ready(self) -> None:
        while True:
            with suppress(OSError):
                async with connect(f"ws://127.0.0.1:{self.port}/socket"):
                    return
            await asyncio.sleep(0.1)

    def cpu_s(self) -> float:
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / CLOCK_TICKS

    def memory_mb(self) -> float:
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6

    def close(self) -> None:
        self.bus.close()
        self.process.terminate()
        self.process.wait(20)


def publish(bus: ZenohBus, frame_sets: list[list[Message]], seconds: float) -> None:
    """Publish every frame set at its time, stamped with the time of publishing."""
    now_ns = time.time_ns()
    for message in (*(camera_info(viewer, now_ns) for viewer in demo_rig("two-view").viewers), body_message(now_ns)):
        bus.publish(topic_of(type(message)), message)
    started_s = time.monotonic()
    for k in range(round(seconds * FPS)):
        time.sleep(max(0.0, started_s + k / FPS - time.monotonic()))
        for message in frame_sets[k % FPS]:
            stamped = msgspec.structs.replace(message, frame=k, captured_ns=time.time_ns())
            bus.publish(topic_of(type(message)), stamped)


def read_pages(port: int, pages: int, parent: Connection) -> None:
    asyncio.run(_read_pages(port, pages, parent))


async def _read_pages(port: int, pages: int, parent: Connection) -> None:
    address = f"ws://127.0.0.1:{port}/socket"
    stalled_page = await connect(address, compression=None, max_size=None)
    stalled_page.transport.pause_reading()
    readers = [await connect(address, compression=None, max_size=None) for _ in range(pages)]
    latencies: list[float] = []
    tasks = [asyncio.create_task(_read(reader, latencies)) for reader in readers]
    parent.send("open")
    for phase in ("measure", "end"):
        while not parent.poll():
            await asyncio.sleep(0.05)
        assert parent.recv() == phase
        if phase == "measure":
            latencies.clear()
    parent.send(latencies)
    for task in tasks:
        task.cancel()


async def _read(connection: ClientConnection, latencies: list[float]) -> None:
    with suppress(ConnectionClosed):
        async for text in connection:
            for update in json.loads(text):
                if update["type"] == "pose":
                    latencies.append(time.time() * 1e3 - update["captured_ms"])
            await connection.send('{"type":"acknowledge"}')


def in_chromium(port: int, _: int, parent: Connection) -> None:
    with sync_playwright() as driver:
        path = shutil.which("chromium")
        page = driver.chromium.launch(executable_path=path, args=FLAGS).new_page(viewport={"width": 1280, "height": 800})
        page.goto(f"http://127.0.0.1:{port}/")
        parent.send("open")
        for phase in ("measure", "end"):
            while not parent.poll():
                page.wait_for_timeout(50)
            assert parent.recv() == phase
            if phase == "measure":
                page.evaluate("zenocap.state.ages.length = 0")
        parent.send(page.evaluate("zenocap.state.ages"))


ANIMATOR = Kind(
    "animator",
    "The animator of a rig at 60 poses/s by the number of open pages, beside one that never reads: latency of a pose "
    "until a page has parsed it, and the animator's processor time and memory.",
    run,
    (
        Column("poses seen", "%", 0, "low", "median"),
        Column("p50", "ms", 1, joined="median"),
        Column("p99", "ms", 1, joined="median"),
        Column("processor", "%", 0, joined="median"),
        Column("memory", "MB", 0, joined="median"),
        Column("growth", "MB", 1, joined="median"),
    ),
    {f"{pages} pages": case("walk", pages=pages) for pages in (0, 1, 4, 16)}
    | {"Chromium": case("walk", chromium=True), "4 pages, 10 minutes": case("walk", pages=4, seconds=600.0)},
    case("walk", seconds=2.0),
    rows="pages",
    timed=True,
)
