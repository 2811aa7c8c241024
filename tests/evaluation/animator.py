"""The animator beside a rig of 60 poses a second: how late pages are, what they cost, and whether memory stays flat.

    python -m tests.evaluation.animator [--seconds N] [--pages 0 1 4 16] [--minutes M] [--chromium]

This process speaks as the rig: two silhouettes and a universal BAP for every instant.  The animator is a process of its
own, and so are the pages, which read all they are sent; one more page never reads.  A pose is late by what passes from
before the BAP is published until the page has it parsed, on one clock.  With --chromium also in a real browser, until its
scene is updated.
"""

import argparse
import asyncio
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Message
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig, demo_rig_file
from common.topics import topic_of
from services.launcher.mesh import free_ports
from services.viewer.shell import camera_info
from tests.evaluation.table import table

FPS = 60
BEGIN_S = 3.0  # before anything is measured
CLOCK_TICKS = os.sysconf("SC_CLK_TCK")
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main(seconds: float, counts: list[int], minutes: float, chromium: bool) -> None:
    film = instants()
    rows = [measured(film, seconds, pages) for pages in counts]
    headings = ["pages", "poses seen", "p50 ms", "p99 ms", "CPU %", "memory MB"]
    print(table(f"Animator at {FPS} poses/s, {seconds:g} s; one more page that never reads", headings, rows))
    if chromium:
        row = measured(film, seconds, 0, chromium=True)
        print(table("The same in Chromium, without a graphics card, to the update of its scene", headings, [row]))
    if minutes:
        print(table(f"Memory over {minutes:g} minutes, 4 pages", ["minute", "MB"], flat(film, minutes)))


def instants() -> list[list[Message]]:
    """One second of walking, again and again."""
    from tests.animator_stand_in import assignment, bap, mask_of, pose_at, sighting, silhouette

    said: list[list[Message]] = []
    for k in range(FPS):
        pose = pose_at(k / FPS)
        masks = [silhouette(viewer.id, k, 0, mask_of(viewer.camera, pose)) for viewer in demo_rig().viewers]
        sightings = [sighting(viewer.id, k, 0) for viewer in demo_rig().viewers]
        said.append([*masks, *sightings, assignment(k, 0, pose), bap(k, 0, pose)])
    return said


class Running:
    """The animator's process, and a bus to speak to it."""

    def __init__(self, folder: Path) -> None:
        self.port, net = free_ports(2)
        command = [
            sys.executable, "-P", "-m", "services.cli", "animator", str(demo_rig_file()), "--port", str(self.port),
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


def speak(bus: ZenohBus, film: list[list[Message]], seconds: float) -> None:
    """Every instant at its time, stamped when it is said."""
    import msgspec

    from tests.animator_stand_in import body_message

    now_ns = time.time_ns()
    for message in (*(camera_info(viewer, now_ns) for viewer in demo_rig().viewers), body_message(now_ns)):
        bus.publish(topic_of(type(message)), message)
    started_s = time.monotonic()
    for k in range(round(seconds * FPS)):
        time.sleep(max(0.0, started_s + k / FPS - time.monotonic()))
        for message in film[k % FPS]:
            stamped = msgspec.structs.replace(message, frame=k, captured_ns=time.time_ns())
            bus.publish(topic_of(type(message)), stamped)


def measured(film: list[list[Message]], seconds: float, pages: int, chromium: bool = False) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        running = Running(Path(folder))
        here, there = multiprocessing.Pipe()
        read = in_chromium if chromium else read_pages
        reader = multiprocessing.get_context("spawn").Process(target=read, args=(running.port, pages, there), daemon=True)
        reader.start()
        here.recv()  # all are open
        try:
            speak(running.bus, film, BEGIN_S)
            here.send("measure")
            before_s, started_s = running.cpu_s(), time.monotonic()
            speak(running.bus, film, seconds)
            share = 100 * (running.cpu_s() - before_s) / (time.monotonic() - started_s)
            here.send("end")
            late = here.recv()
            memory = running.memory_mb()
        finally:
            reader.terminate()
            running.close()
    p50, p99 = np.percentile(late, [50, 99]) if late else (float("nan"), float("nan"))
    seen = f"{len(late)} of {round(seconds * FPS) * max(1, pages)}" if late else "-"
    return [str(pages + chromium), seen, f"{p50:.1f}", f"{p99:.1f}", f"{share:.0f}", f"{memory:.0f}"]


def read_pages(port: int, pages: int, parent: Connection) -> None:
    asyncio.run(_read_pages(port, pages, parent))


async def _read_pages(port: int, pages: int, parent: Connection) -> None:
    address = f"ws://127.0.0.1:{port}/socket"
    never = await connect(address, compression=None, max_size=None)
    never.transport.pause_reading()
    readers = [await connect(address, compression=None, max_size=None) for _ in range(pages)]
    late: list[float] = []
    tasks = [asyncio.create_task(_read(reader, late)) for reader in readers]
    parent.send("open")
    for said in ("measure", "end"):
        while not parent.poll():
            await asyncio.sleep(0.05)
        assert parent.recv() == said
        if said == "measure":
            late.clear()
    parent.send(late)
    for task in tasks:
        task.cancel()


async def _read(connection: ClientConnection, late: list[float]) -> None:
    with suppress(ConnectionClosed):
        async for text in connection:
            for piece in json.loads(text):
                if piece["is"] == "pose":
                    late.append(time.time() * 1e3 - piece["captured_ms"])
            await connection.send('{"is":"got"}')


def in_chromium(port: int, _: int, parent: Connection) -> None:
    import shutil

    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        path = shutil.which("chromium")
        page = driver.chromium.launch(executable_path=path, args=FLAGS).new_page(viewport={"width": 1280, "height": 800})
        page.goto(f"http://127.0.0.1:{port}/")
        parent.send("open")
        for said in ("measure", "end"):
            while not parent.poll():
                page.wait_for_timeout(50)
            assert parent.recv() == said
            if said == "measure":
                page.evaluate("zenocap.state.ages.length = 0")
        parent.send(page.evaluate("zenocap.state.ages"))


def flat(film: list[list[Message]], minutes: float) -> list[list[str]]:
    """Memory at the end of every minute."""
    with tempfile.TemporaryDirectory() as folder:
        running = Running(Path(folder))
        here, there = multiprocessing.Pipe()
        reader = multiprocessing.get_context("spawn").Process(target=read_pages, args=(running.port, 4, there), daemon=True)
        reader.start()
        here.recv()
        rows = []
        try:
            for minute in range(round(minutes)):
                speak(running.bus, film, 60)
                rows.append([str(minute + 1), f"{running.memory_mb():.1f}"])
        finally:
            reader.terminate()
            running.close()
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--pages", type=int, nargs="+", default=[0, 1, 4, 16])
    parser.add_argument("--minutes", type=float, default=0.0, help="of the memory's measurement")
    parser.add_argument("--chromium", action="store_true", help="also in a real browser")
    given = parser.parse_args()
    main(given.seconds, given.pages, given.minutes, given.chromium)
