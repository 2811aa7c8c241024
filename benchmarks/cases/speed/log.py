"""Speed and cost of the log with a realistic mixture of messages, that of the tracked demo."""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.cases.takes.mixture import START_NS, instants, mixture, with_viewers
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import Size, size_of
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Envelope, Received
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.recording.log import Log
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.recording.writer import Recording, no_conversion
from zenocap.common.runtime.clock import RealClock
from zenocap.tools.takes.recover import recover

FPS = 60.0


class WaitingBus(LocalBus):
    """A bus whose receive waits for messages, as on the network."""

    def __init__(self, network: LocalNetwork) -> None:
        super().__init__(network, network.clock)
        network.buses.append(self)

    def receive(self, timeout_s: float = 0.0) -> Received | None:
        return self._inbox.take(timeout_s)

    def wake(self) -> None:
        self._inbox.wake()


def frame_sets(size: Size, viewers: int, count: int) -> Iterator[list[Envelope]]:
    """`count` frame sets at FPS of `viewers` viewers."""
    groups = instants(mixture(size))
    step_ns = round(1e9 / FPS)
    return (list(with_viewers(groups[k % len(groups)], viewers, k, START_NS + k * step_ns)) for k in range(count))


def run(one: Case) -> Figures:
    """Messages and megabytes per second of an operation, the film.  Options: size, foxglove, messages."""
    messages: list[Envelope] = []
    count, foxglove = one.option("messages", 20_000), one.option("foxglove", False)
    for group in frame_sets(size_of(one.option("size", "160x120")), 2, count):
        messages += group
        if len(messages) >= count:
            break
    count, megabytes = len(messages), sum(len(each.data) for each in messages) / 1e6
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "take.mcap"
        write(path, messages)
        operations: dict[str, Callable[[], int]] = {
            "written": lambda: write(path, messages, foxglove),
            "from queue to disk": lambda: logged(path, messages, foxglove),
            "read": lambda: sum(1 for _ in TakeReader(path).messages()),
            "read and decoded": lambda: sum(envelope(each) is not None for each in TakeReader(path).messages()),
            "recovered": lambda: recovered(path),
        }
        started_s = time.perf_counter()
        assert operations[one.film]() == count
        spent_s = time.perf_counter() - started_s
    return {"rate": count / spent_s, "volume": megabytes / spent_s}


def run_thread(one: Case) -> Figures:
    """Processor share of the log's thread at 60 frames/s.  Options: size, viewers, foxglove, seconds."""
    groups = list(frame_sets(size_of(one.option("size", "160x120")), one.option("viewers", 8), 240))
    network = LocalNetwork("demo", RealClock())
    with tempfile.TemporaryDirectory() as folder:
        log = Log(WaitingBus(network), opened(Path(folder) / "take.mcap", one.option("foxglove", False)))
        log.start()
        started_s = time.monotonic()
        for k in range(round(one.option("seconds", 30.0) * FPS)):
            for each in groups[k % len(groups)]:
                for bus in network.buses:
                    bus.deliver(each.key, each.data)
            time.sleep(max(0.0, started_s + (k + 1) / FPS - time.monotonic()))
        elapsed_s = time.monotonic() - started_s
        end = log.close()
    return {"rate": end.messages / elapsed_s, "processor": 100 * log.cpu_ns / 1e9 / elapsed_s, "lost": end.lost}


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
    log = Log(WaitingBus(network), opened(path, foxglove))
    log.start()
    for number, each in enumerate(messages):
        for bus in network.buses:
            bus.deliver(each.key, each.data)
        while number % 500 == 0 and log.statistics.messages < number - 2000:
            time.sleep(0.001)
    end = log.close()
    assert end.lost == 0
    return end.messages


_SIZES = ("160x120", "640x480")
LOG = Kind(
    "log",
    "Messages of the demo's mixture written, read and recovered; from queue to disk: with all checks, through the log's "
    "thread.",
    run,
    (Quantity("rate", "messages/s", 0, "low", "median"), Quantity("volume", "MB/s", 0, "low", "median")),
    {
        f"{name}, {size}": case(name, size=size)
        for name in ("written", "from queue to disk", "read", "read and decoded", "recovered")
        for size in _SIZES
    }
    | {
        f"{name} with Foxglove channels, {size}": case(name, size=size, foxglove=True)
        for name in ("written", "from queue to disk")
        for size in _SIZES
    },
    case("written", messages=500),
    rows="operation, size",
    timed=True,
)
LOG_THREAD = Kind(
    "log-thread",
    "Share of a core that the log's thread takes while the messages of eight viewers at 60 frames/s arrive.",
    run_thread,
    (Quantity("rate", "messages/s", 0, "low"), Quantity("processor", "%", 1), Quantity("lost", "", 0, joined="sum")),
    {
        f"{size}{', with Foxglove channels' if foxglove else ''}": case("mixture", size=size, foxglove=foxglove)
        for size in _SIZES
        for foxglove in (False, True)
    },
    case("mixture", viewers=2, seconds=2.0),
    rows="size",
    timed=True,
)
