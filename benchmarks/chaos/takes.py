"""The takes of a run, read with the mcap package, and the answers of `zenocap info` and `verify`."""

import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from benchmarks.chaos.observer import Place, SeenFrame, SeenPose, is_real, place_at
from benchmarks.chaos.schedule import SERVICES
from tests.support.places import ROOT
from zenocap.common.topics import TRACKER_POSE, UNIVERSAL_BAP

POSES: tuple[Place, ...] = ((TRACKER_POSE.name, "tracker"), (UNIVERSAL_BAP.name, "integrator"))
DONE, FAILED, LOSS = 0, 1, 3
MOST_S, MOST_MEMORY_KB = 240.0, 8 << 20  # of `info` and `verify`; address space, of which numpy and LLVM reserve much
Span = tuple[int, int]  # from, until (ns)
Seen = TypeVar("Seen", SeenFrame, SeenPose)
BEGIN_NS, END_NS = 1_500_000_000, 2_500_000_000  # at the ends of a file, in which a pose may or may not be in it


@dataclass
class Content:
    """What the mcap package reads from a take.  recorded: (capture time, frame) of what services of the rig count as sent.

    counted, forged: numbers of these, and of those that another program has sent.  whole: finished, checksums right.
    """

    path: Path
    messages: int = 0
    recorded: dict[Place, set[tuple[int, int]]] = field(default_factory=lambda: defaultdict(set))
    first_ns: int = 0
    last_ns: int = 0
    whole: bool = False
    counted: int = 0
    forged: Counter[Place] = field(default_factory=Counter)


def content(path: Path) -> Content:
    """Read a take, up to its damage if there is any."""
    found = Content(path)
    keys: dict[int, str] = {}
    try:
        with path.open("rb") as file:
            for record in StreamReader(file, validate_crcs=True).records:
                match record:
                    case Channel(id=id, topic=topic):
                        keys[id] = topic
                    case Message():
                        _add(found, keys.get(record.channel_id, ""), record)
        with path.open("rb") as file:
            summary = make_reader(file, validate_crcs=True).get_summary()
            found.whole = summary is not None and summary.statistics is not None
    except (McapError, EOFError, OSError, ValueError):
        found.whole = False
    return found


def _add(found: Content, key: str, message: Message) -> None:
    found.messages += 1
    found.first_ns = found.first_ns or message.log_time
    found.last_ns = max(found.last_ns, message.log_time)
    place = place_at(key)
    if place is not None and place[1] in SERVICES:
        found.counted += 1
        found.forged[place] += not is_real(message.publish_time, message.log_time)
        found.recorded[place].add((message.publish_time, message.sequence))


def unrecorded(seen: Iterable[Seen], takes: Sequence[Content], places: Collection[Place]) -> list[Seen]:
    """Messages of some places that are in no take."""
    recorded = set().union(*(take.recorded.get(place, ()) for take in takes for place in places))
    return [one for one in seen if (one.captured_ns, one.frame % 2**32) not in recorded]


def in_takes(seen: Iterable[Seen], takes: Sequence[Content], excused: Sequence[Span]) -> list[Seen]:
    """Messages that were received while a take was being written; without those of excused times."""
    spans = [(take.first_ns + BEGIN_NS, take.last_ns - END_NS) for take in takes]
    return [one for one in seen if within(one.received_ns, spans) and not within(one.received_ns, excused)]


def missing_poses(poses: Sequence[SeenPose], takes: Sequence[Content], excused: Sequence[Span]) -> list[SeenPose]:
    """Poses that were published while a take was being written, and are in none; without those of excused times."""
    return in_takes(unrecorded(poses, takes, POSES), takes, excused)


def uncovered_poses(poses: Sequence[SeenPose], logging: Sequence[Span], excused: Sequence[Span]) -> list[SeenPose]:
    """Poses of times at which the integrator said that it records, and which no take covers: see `logging_without_file`."""
    return [pose for pose in poses if within(pose.received_ns, logging) and not within(pose.received_ns, excused)]


def within(time_ns: int, spans: Sequence[Span]) -> bool:
    return any(begin <= time_ns <= end for begin, end in spans)


def dishonest(take: Content, *, forged: bool) -> list[str]:
    """What `zenocap info` and `zenocap verify` say wrongly about a take.  forged: whether it may have forged poses."""
    found = []
    status, output = _command("info", take.path)
    if "Traceback" in output or status not in ((DONE,) if take.whole else (FAILED, LOSS)):
        expected = "intact" if take.whole else "not intact"
        found.append(f"{take.path.name}: info: status {status} of a take that is {expected}: {output[-300:]}")
    if forged or not take.messages:
        return found
    status, output = _command("verify", take.path)
    different = status == FAILED and "nothing" not in output
    if "Traceback" in output or different or status not in (DONE, FAILED, LOSS):
        found.append(f"{take.path.name}: verify: status {status}: {output[-600:]}")
    return found


def _command(command: str, take: Path) -> tuple[int, str]:
    """Exit status and output of a command on a take, within bounds of time and memory; status -1 beyond them."""
    limit = f'ulimit -v {MOST_MEMORY_KB}; exec "$0" "$@"'
    line = ["sh", "-c", limit, sys.executable, "-m", "zenocap", command, str(take)]
    try:
        done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=MOST_S, check=False)
    except subprocess.TimeoutExpired:
        return -1, f"not within {MOST_S:g} s"
    return done.returncode, done.stdout + done.stderr
