"""Speed and cost of the log with the real mixture of messages.

    python -m tests.evaluation.logging [--seconds N] [--viewers N] [--fps N]

The mixture is what the demo's rig says when it is tracked, at two working sizes.  Writing and reading are timed alone,
and from the bus's queue through the log's thread (checked, decoded, written); the share of a processor is the time of
the log's own thread while messages come at the pace of that many viewers.
"""

import argparse
import tempfile
import time
from pathlib import Path

from common.body.anatomy import TEN_PARTS
from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Envelope, Received
from common.formats.foxglove.converter import Foxglove
from common.runtime.clock import RealClock
from common.take.log import Log
from common.take.reading import Take, envelope
from common.take.recording import Recording, nothing_beside
from services.takes.recover import recover
from tests.evaluation.mixture import START_NS, instants, mixture, sized, with_viewers
from tests.evaluation.table import Cell, table
from tests.evaluation.takes import LARGE, SMALL, Size

FPS, LENGTH = 60.0, 20_000


class WaitingBus(LocalBus):
    """Waits for messages as a bus of the network does."""

    def receive(self, timeout_s: float = 0.0) -> Received | None:
        return self._inbox.take(timeout_s)

    def wake(self) -> None:
        self._inbox.wake()


def waiting_bus(network: LocalNetwork) -> LocalBus:
    bus = WaitingBus(network, network.clock)
    network.buses.append(bus)
    return bus


def live(size: Size, viewers: int, count: int) -> list[list[Envelope]]:
    """`count` instants at FPS of so many viewers."""
    groups = instants(mixture(size))
    step_ns = round(1e9 / FPS)
    return [list(with_viewers(groups[k % len(groups)], viewers, k, START_NS + k * step_ns)) for k in range(count)]


def speeds(size: Size, folder: Path) -> list[list[Cell]]:
    """Messages and megabytes a second of writing, reading, decoding and recovering; the best of three."""
    said: list[Envelope] = []
    for group in live(size, 2, LENGTH):
        said += group
        if len(said) >= LENGTH:
            break
    path = folder / "take.mcap"
    write(path, said)
    ways = {
        "written": lambda: write(path, said),
        "read": lambda: sum(1 for _ in Take(path).messages()),
        "read and decoded": lambda: sum(envelope(each) is not None for each in Take(path).messages()),
        "recovered": lambda: recovered(path),
        "logged: queue, check, write": lambda: logged(path, said),
        "written with Foxglove channels": lambda: write(path, said, foxglove=True),
        "logged with Foxglove channels": lambda: logged(path, said, foxglove=True),
    }
    count, bytes_ = sized(said)
    rows: list[list[Cell]] = []
    for name, way in ways.items():
        times = []
        for _ in range(3):
            started_s = time.perf_counter()
            assert way() == count
            times.append(time.perf_counter() - started_s)
        rows.append([f"{size[0]}x{size[1]} {name}", count, round(count / min(times)), bytes_ / 1e6 / min(times)])
    rows.append([f"{size[0]}x{size[1]} bytes of a message, in the file", count, "", path.stat().st_size / count])
    return rows


def opened(path: Path, foxglove: bool) -> Recording:
    """foxglove: with the channels that Foxglove shows, as a rig's log has them unless it says otherwise."""
    beside = Foxglove(TEN_PARTS, "demo").beside if foxglove else nothing_beside
    return Recording(path, rig="demo", start_ns=START_NS, overwrite=True, beside=beside)


def write(path: Path, said: list[Envelope], foxglove: bool = False) -> int:
    recording = opened(path, foxglove)
    for each in said:
        recording.record(each)
    return recording.close().messages


def recovered(path: Path) -> int:
    output = path.with_name("recovered.mcap")
    output.unlink(missing_ok=True)
    return recover(path, output).messages


def logged(path: Path, said: list[Envelope], foxglove: bool = False) -> int:
    """Through a bus's queue and the log's thread."""
    network = LocalNetwork("demo", RealClock())
    log = Log(waiting_bus(network), opened(path, foxglove))
    log.start()
    for number, each in enumerate(said):
        for bus in network.buses:
            bus.hear(each.key, each.data)
        while number % 500 == 0 and log.statistics.messages < number - 2000:
            time.sleep(0.001)
    end = log.close()
    assert end.lost == 0
    return end.messages


def share(size: Size, viewers: int, seconds: float, folder: Path, foxglove: bool) -> list[Cell]:
    """Messages a second, share of a processor in percent, lost: at the pace of FPS."""
    groups = live(size, viewers, 240)
    network = LocalNetwork("demo", RealClock())
    log = Log(waiting_bus(network), opened(folder / "take.mcap", foxglove))
    log.start()
    started_s = time.monotonic()
    count = round(seconds * FPS)
    for k in range(count):
        for each in groups[k % len(groups)]:
            for bus in network.buses:
                bus.hear(each.key, each.data)
        time.sleep(max(0.0, started_s + (k + 1) / FPS - time.monotonic()))
    took_s = time.monotonic() - started_s
    end = log.close()
    name = f"{size[0]}x{size[1]}, {viewers} viewers{', with Foxglove channels' if foxglove else ''}"
    return [name, round(end.messages / took_s), end.bytes / 1e6 / took_s, 100 * log.cpu_ns / 1e9 / took_s, end.lost]


def main(seconds: float, viewers: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        rows = [row for size in (SMALL, LARGE) for row in speeds(size, Path(folder))]
        print(table("The log's speed, the real mixture", ["", "messages", "messages/s", "MB/s, or bytes"], rows))
        shares = [share(size, viewers, seconds, Path(folder), fox) for size in (SMALL, LARGE) for fox in (False, True)]
        columns = ["", "messages/s", "MB/s", "share of a processor, %", "lost"]
        print(table(f"The log's thread at {FPS:g} frames/s", columns, shares))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--viewers", type=int, default=8)
    options = parser.parse_args()
    main(options.seconds, options.viewers)
