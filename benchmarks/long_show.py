"""`zenocap show` on a long take: time to the first picture, and from a move of the slider to the picture of that place.

    python -m benchmarks.long_show walk.mcap [--minutes 60] [--views 4] [--starts 5] [--moves 40] [--make long.mcap]

The long take is the given one, repeated with later times, every second frame, without Foxglove channels.  The given, short
take is measured in turn with it: what both have in common is of the machine and its other work.  Chromium has no graphics
card.  first picture: from the start of the command, or from the opening of the page, until a pose is drawn.  move: from the
event of the slider until the pose of its place is drawn; the page gets it with the pose.  Processor times, of the command
and its replay, and of the browser, depend less on the machine's other work.
"""

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.animator import FLAGS
from benchmarks.page_pictures import SIZE, await_page, await_pose
from benchmarks.page_speed import browser_cpu_s, processor_s
from benchmarks.table import Cell, table
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.recording.reader import Recorded, Take, envelope
from zenocap.common.recording.summary import read_summary
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.tools.launcher.peer_mesh import free_ports
from zenocap.tools.recordings.take_part import frame_of
from zenocap.tools.replay.time_shift import Shift, shifted

PATIENCE_MS = 60_000
NEAR_S = 0.05  # of the shown pose to the place of the slider: a pose of 30/s and half of one
STILL_MS = 400  # between two moves
WATCH = """(target) => new Promise((done) => {
  const slider = document.getElementById('position'), begun = performance.now();
  const before = zenocap.state.count;
  slider.value = target; slider.dispatchEvent(new Event('input'));
  const look = () => {
    const pose = zenocap.state.poses.get(zenocap.state.source);
    const late = performance.now() - begun;
    if (zenocap.state.count > before && pose && Math.abs(zenocap.state.shown_s - target) <= %g)
      requestAnimationFrame(() => done(performance.now() - begun));
    else if (late > %d) done(-1); else setTimeout(look, 2);
  };
  look();
})"""


def long_take(source: Path, path: Path, minutes: float, views: int) -> int:
    """Write the messages of a take again and again, each time later; return the number of messages."""
    take = Take(source)
    messages = [one for recorded in take.messages() if (one := _kept(recorded, views)) is not None]
    rig = next(each.key.split("/")[1] for each in messages)
    posed = [each.message for each in messages if isinstance(each.message, m.UniversalBap | m.TrackerPose)]
    begin_ns, end_ns = posed[0].captured_ns, posed[-1].captured_ns
    period_ns = end_ns - begin_ns + 2 * (end_ns - begin_ns) // max(1, posed[-1].frame - posed[0].frame)
    frames = posed[-1].frame - posed[0].frame + 2
    files = tuple(Attachment(name, "application/octet-stream", data) for name, data in take.attachments.items())
    recording = Recording(path, rig=rig, start_ns=messages[0].received_ns, attachments=files, overwrite=True)
    count, laps = 0, int(60e9 * minutes / period_ns) + 1
    for lap in range(laps):
        shift = Shift(lap * period_ns, lap * frames)
        for each in messages:
            of_motion = each.message.captured_ns >= begin_ns
            if lap and not of_motion:
                continue
            message = shifted(each.message, shift)
            recording.record(
                Envelope(each.key, each.topic, message, each.received_ns + shift.time_ns, codec.encode(message))
            )
            count += 1
    recording.close()
    return count


def _kept(recorded: Recorded, views: int) -> Envelope | None:
    """The message to repeat; None for one of an odd frame, of a further view, or that shows the take to other programs."""
    if not recorded.topic.startswith("zenocap/") or recorded.topic.endswith(("/handled", "/verdict")):
        return None
    frame, found = frame_of(recorded), envelope(recorded)
    viewer = getattr(found.message, "viewer", "") if found is not None else ""
    if (frame is not None and frame % 2) or (viewer and int("".join(filter(str.isdigit, viewer)) or 0) > views):
        return None
    return found


@contextmanager
def shown(take: Path) -> Iterator[tuple[str, float, int]]:
    """Address of the page, when the command was begun, and its process."""
    (port,) = free_ports(1)
    begun_s = time.monotonic()
    command = [sys.executable, "-P", "-m", "zenocap", "show", str(take), "--port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        await_page(f"http://127.0.0.1:{port}/")
        yield f"http://127.0.0.1:{port}/", begun_s, process.pid
    finally:
        process.terminate()
        process.wait(30)


def first_picture(take: Path, browser: Browser) -> tuple[float, ...]:
    """Seconds: from the start of the command until the page is served, from there until a pose is drawn, their sum.

    Then the processor time of the command until the page is served, and of command and browser until a pose is drawn.
    """
    with shown(take) as (address, begun_s, command):
        served_s, served_cpu_s, browser_s = time.monotonic(), processor_s(command), browser_cpu_s()
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        await_pose(page)
        drawn_s, drawn_cpu_s, browser_s = time.monotonic(), processor_s(command), browser_cpu_s() - browser_s
        page.close()
    return served_s - begun_s, drawn_s - served_s, drawn_s - begun_s, served_cpu_s, drawn_cpu_s, browser_s


def moves(take: Path, browser: Browser, count: int) -> tuple[list[float], float, float]:
    """Milliseconds from moves of the slider of a paused take until the pose of the place is drawn.

    Then the processor time of the command and of the browser per move, milliseconds, with what a paused page costs.
    """
    summary = read_summary(take)
    assert summary is not None
    duration_s = (max(chunk.message_end_time for chunk in summary.chunks) - summary.start_ns) / 1e9
    chance = Random(1)
    found: list[float] = []
    with shown(take) as (address, _, command):
        page: Page = browser.new_page(viewport=SIZE)
        page.goto(address)
        await_pose(page)
        page.wait_for_timeout(3000)
        page.click("#pause")
        page.wait_for_timeout(1000)
        used_s, browser_s = processor_s(command), browser_cpu_s()
        for _ in range(count):
            target = round(chance.uniform(0.3 * min(duration_s, 8.0), duration_s - 0.3), 2)
            found.append(float(page.evaluate(WATCH % (NEAR_S, PATIENCE_MS), target)))
            page.wait_for_timeout(STILL_MS)
        used_s, browser_s = processor_s(command) - used_s, browser_cpu_s() - browser_s
        page.close()
    return found, 1e3 * used_s / count, 1e3 * browser_s / count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("take", type=Path)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--views", type=int, default=4)
    parser.add_argument("--starts", type=int, default=5)
    parser.add_argument("--moves", type=int, default=40)
    parser.add_argument("--make", type=Path, help="Where the long take is kept; an existing one is used.")
    options = parser.parse_args()
    with TemporaryDirectory() as name, sync_playwright() as driver:
        long = options.make or Path(name) / "long.mcap"
        short = Path(name) / "short.mcap"
        long_take(options.take, short, 0.0, options.views)
        if not long.is_file():
            print(f"{long_take(options.take, long, options.minutes, options.views)} messages", flush=True)
        print(f"{long.stat().st_size / 1e6:.0f} MB")
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        starts: dict[Path, list[tuple[float, ...]]] = {short: [], long: []}
        for _ in range(options.starts):
            for take, found in starts.items():
                found.append(first_picture(take, browser))
        rows: list[list[Cell]] = []
        for kind, column in (
            ("command to page, s", 0),
            ("page to first picture, s", 1),
            ("command to first picture, s", 2),
            ("processor time of the command until the page, s", 3),
            ("processor time of the command until the first picture, s", 4),
            ("processor time of the browser, page to first picture, s", 5),
        ):
            for title, take in (("short", short), ("long", long)):
                values = [one[column] for one in starts[take]]
                rows.append([kind, title, len(values), float(np.median(values)), max(values)])
        for title, take in (("short", short), ("long", long)) if options.moves else ():
            values, command_ms, browser_ms = moves(take, browser, options.moves)
            rows.append(["processor time of the command per move, ms", title, len(values), command_ms, command_ms])
            rows.append(["processor time of the browser per move, ms", title, len(values), browser_ms, browser_ms])
            rows.append(["move to its picture, ms", title, len(values), float(np.median(values)), max(values)])
        browser.close()
    print(table("`zenocap show`", ["what", "take", "number", "median", "worst"], rows))


if __name__ == "__main__":
    main()
