"""Speed and cost of the log with a realistic mixture of messages.

    python -m benchmarks.logging [--seconds N] [--viewers N] [--messages N]

The mixture is the messages of the tracked demo at two working sizes.  Writing and reading are timed alone, and from the
queue of the bus through the thread of the log (validated, decoded, written); the processor share is that of the thread
while messages arrive at the rate of that many viewers.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.takes import LARGE, SMALL, Size

from benchmarks.mixture import START_NS, instants, mixture, sized, with_viewers
from benchmarks.table import Cell, table
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Envelope, Received
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.recording.log import Log
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.recording.writer import Recording, no_conversion
from zenocap.common.runtime.clock import RealClock
from zenocap.tools.recordings.recover import recover

FPS = 60.0


class WaitingBus(LocalBus):
    """A bus whose receive waits for messages, as on the network."""

    def receive(self, timeout_s: float = 0.0) -> Received | None:
        return self._inbox.take(timeout_s)

    def wake(self) -> None:
        self._inbox.wake()


def waiting_bus(network: LocalNetwork) -> LocalBus:
    bus = WaitingBus(network, network.clock)
    network.buses.append(bus)
    return bus


def frame_sets(size: Size, viewers: int, count: int) -> Iterator[list[Envelope]]:
    """`count` frame sets at FPS of `viewers` viewers."""
    groups = instants(mixture(size))
    step_ns = round(1e9 / FPS)
    return (list(with_viewers(groups[k % len(groups)], viewers, k, START_NS + k * step_ns)) for k in range(count))


def speeds(size: Size, folder: Path, count: int) -> list[list[Cell]]:
    """Messages and megabytes per second of writing, reading, decoding and recovering; best of three runs."""
    messages: list[Envelope] = []
    for group in frame_sets(size, 2, count):
        messages += group
        if len(messages) >= count:
            break
    path = folder / "take.mcap"
    write(path, messages)
    operations: dict[str, Callable[[], int]] = {
        "written": lambda: write(path, messages),
        "read": lambda: sum(1 for _ in Take(path).messages()),
        "read and decoded": lambda: sum(envelope(each) is not None for each in Take(path).messages()),
        "recovered": lambda: recovered(path),
        "logged: queue, check, write": lambda: logged(path, messages),
        "written with Foxglove channels": lambda: write(path, messages, foxglove=True),
        "logged with Foxglove channels": lambda: logged(path, messages, foxglove=True),
    }
    count, bytes_ = sized(messages)
    rows: list[list[Cell]] = []
    for name, operation in operations.items():
        times = []
        for _ in range(3):
            started_s = time.perf_counter()
            assert operation() == count
            times.append(time.perf_counter() - started_s)
        rows.append([f"{size[0]}x{size[1]} {name}", count, round(count / min(times)), bytes_ / 1e6 / min(times)])
    rows.append([f"{size[0]}x{size[1]} bytes of a message, in the file", count, "", path.stat().st_size / count])
    return rows


def opened(path: Path, foxglove: bool) -> Recording:
    """foxglove: with the Foxglove channels, the default of a rig."""
    convert = FoxgloveConverter(TEN_PARTS, "demo").convert if foxglove else no_conversion
    return Recording(path, rig="demo", start_ns=START_NS, overwrite=True, convert=convert)


def write(path: Path, messages: list[Envelope], foxglove: bool = False) -> int:
    recording = opened(path, foxglove)
    for each in messages:
        recording.record(each)
    return recording.close().messages


def recovered(path: Path) -> int:
    output = path.with_name("recovered.mcap")
    output.unlink(missing_ok=True)
    return recover(path, output).messages


def logged(path: Path, messages: list[Envelope], foxglove: bool = False) -> int:
    """Write messages through the queue of a bus and the log's thread."""
    network = LocalNetwork("demo", RealClock())
    log = Log(waiting_bus(network), opened(path, foxglove))
    log.start()
    for number, each in enumerate(messages):
        for bus in network.buses:
            bus.deliver(each.key, each.data)
        while number % 500 == 0 and log.statistics.messages < number - 2000:
            time.sleep(0.001)
    end = log.close()
    assert end.lost == 0
    return end.messages


def share(size: Size, viewers: int, seconds: float, folder: Path, foxglove: bool) -> list[Cell]:
    """Messages per second, processor share (%) and lost messages at FPS frames per second."""
    groups = list(frame_sets(size, viewers, 240))
    network = LocalNetwork("demo", RealClock())
    log = Log(waiting_bus(network), opened(folder / "take.mcap", foxglove))
    log.start()
    started_s = time.monotonic()
    count = round(seconds * FPS)
    for k in range(count):
        for each in groups[k % len(groups)]:
            for bus in network.buses:
                bus.deliver(each.key, each.data)
        time.sleep(max(0.0, started_s + (k + 1) / FPS - time.monotonic()))
    elapsed_s = time.monotonic() - started_s
    end = log.close()
    name = f"{size[0]}x{size[1]}, {viewers} viewers{', with Foxglove channels' if foxglove else ''}"
    return [
        name,
        round(end.messages / elapsed_s),
        end.bytes / 1e6 / elapsed_s,
        100 * log.cpu_ns / 1e9 / elapsed_s,
        end.lost,
    ]


def main(seconds: float, viewers: int, messages: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        rows = [row for size in (SMALL, LARGE) for row in speeds(size, Path(folder), messages)]
        print(table("The log's speed, a realistic mixture", ["", "messages", "messages/s", "MB/s, or bytes"], rows))
        shares = [share(size, viewers, seconds, Path(folder), fox) for size in (SMALL, LARGE) for fox in (False, True)]
        columns = ["", "messages/s", "MB/s", "share of a processor, %", "lost"]
        print(table(f"The log's thread at {FPS:g} frames/s", columns, shares))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--viewers", type=int, default=8)
    parser.add_argument("--messages", type=int, default=20_000, help="written and read for the speeds (default 20000)")
    options = parser.parse_args()
    main(options.seconds, options.viewers, options.messages)
