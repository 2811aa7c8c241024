"""Takes cut at every 1 % or damaged at random: results of reading, `info` and `recover`.

Each damaged file must be rejected or read, without a traceback; the exit status may be 0 only when nothing is lost;
messages read must equal messages written; and recovered files must be intact for the reader of the mcap package.
"""

import random
import re
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from mcap.reader import make_reader
from typer.testing import CliRunner

from benchmarks.cases.takes.mixture import tracked_take
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from zenocap.common.recording.reader import Recorded, TakeReader
from zenocap.tools.cli.main import program

RANDOM = 25  # files of a seed and a kind
Damaging = Callable[[bytes, random.Random], bytes]


def flip_bit(content: bytes, rng: random.Random) -> bytes:
    return _put(content, at := rng.randrange(len(content)), bytes([content[at] ^ 1 << rng.randrange(8)]))


def flip_some(content: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.randint(2, 50)):
        content = flip_bit(content, rng)
    return content


def overwrite(content: bytes, rng: random.Random) -> bytes:
    return _put(content, rng.randrange(len(content)), rng.randbytes(rng.randint(1, 5000)))


def zero(content: bytes, rng: random.Random) -> bytes:
    """Zero blocks, as after a power failure."""
    return _put(content, rng.randrange(len(content)) // 4096 * 4096, bytes(4096 * rng.randint(1, 8)))


def leave_out(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content))
    return content[:at] + content[at + rng.randint(1, 50_000) :]


def put_in(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content))
    return content[:at] + rng.randbytes(rng.randint(1, 5000)) + content[at:]


def wrong_length(content: bytes, rng: random.Random) -> bytes:
    """Change a length in the head of a chunk: of its data, or of its uncompressed data."""
    found = (one.start() for one in re.finditer(b"\x04\0\0\0zstd", content))
    chunks = [at for at in found if content[at - 37 : at - 36] == b"\x06"]
    at = rng.choice(chunks) + rng.choice((-36, 8, -12))
    value = rng.choice((0, 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, rng.randrange(len(content))))
    return _put(content, at, value.to_bytes(8, "little"))


def beginning(content: bytes, rng: random.Random) -> bytes:
    return _put(content, 0, rng.randbytes(rng.randint(1, 2000)))


def end(content: bytes, rng: random.Random) -> bytes:
    size = rng.randint(1, 2000)
    return content[:-size] + rng.randbytes(size)


def repeat(content: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(content))
    part = content[start : start + rng.randint(1, 20_000)]
    return _put(content, rng.randrange(len(content)), part)


KINDS: tuple[Damaging, ...] = (
    flip_bit, flip_some, overwrite, zero, leave_out, put_in, wrong_length, beginning, end, repeat,
)  # fmt: skip


@dataclass
class Findings:
    """Results.  statuses: exit statuses of info and recover.  faults: violated requirements."""

    files: int = 0
    statuses: Counter[tuple[int, int]] = field(default_factory=Counter)
    shares: list[float] = field(default_factory=list)
    slowest_s: float = 0.0
    faults: list[str] = field(default_factory=list)

    def figures(self) -> dict[str, float]:
        shares = [100.0 * share for share in self.shares] or [0.0]
        intact = self.statuses[0, 0]
        return {
            "files": self.files,
            "called intact": intact,
            "kept": sum(shares) / len(shares),
            "least kept": min(shares),
            "slowest": self.slowest_s,
            "faults": len(self.faults),
        }


class Judge:
    """Compares damaged copies of a take with the take."""

    def __init__(self, take: Path, folder: Path) -> None:
        self.content = take.read_bytes()
        whole = TakeReader(take)
        self._messages = list(whole.messages())
        self._known = Counter(_identity(message) for message in self._messages)
        self._rest = (whole.attachments, whole.metadata)
        self._path, self._output = folder / "damaged.mcap", folder / "recovered.mcap"

    def check(self, content: bytes, name: str, findings: Findings) -> None:
        """Run info and recover on `content` and check both results."""
        self._path.write_bytes(content)
        self._output.unlink(missing_ok=True)
        found: list[int] = []
        for arguments in (["info", str(self._path)], ["recover", str(self._path), "-o", str(self._output)]):
            started_s = time.monotonic()
            status, output = in_process(*arguments)
            findings.slowest_s = max(findings.slowest_s, time.monotonic() - started_s)
            found.append(status)
            if "Traceback" in output or status not in (0, 1, 3):
                findings.faults.append(f"{name}: {arguments[0]}: status {status}: {output[-300:]}")
        info, recovered = found
        findings.files += 1
        findings.statuses[info, recovered] += 1
        if (info == 0) != (content == self.content):
            findings.faults.append(f"{name}: info {info}")
        if recovered == 1:
            if self._output.exists():
                findings.faults.append(f"{name}: nothing to recover, but an output file exists")
            return
        self._check_recovered(name, recovered, findings)

    def _check_recovered(self, name: str, status: int, findings: Findings) -> None:
        take = TakeReader(self._output)
        messages = list(take.messages())
        findings.shares.append(len(messages) / len(self._messages))
        if {_identity(each) for each in messages} - self._known.keys():
            findings.faults.append(f"{name}: a message that was never written")
        if status == 0 and (messages != self._messages or self._rest != (take.attachments, take.metadata)):
            findings.faults.append(f"{name}: messages or attachments are missing, but the status is 0")
        if take.cut:
            findings.faults.append(f"{name}: the recovered file is not intact: {take.cut}")
        with self._output.open("rb") as file:
            summary = make_reader(file, validate_crcs=True).get_summary()
            if summary is None or summary.statistics is None or summary.statistics.message_count != len(messages):
                findings.faults.append(f"{name}: the reader of the mcap package finds another summary")


def in_process(*arguments: str) -> tuple[int, str]:
    """Exit status and output of a command run in this process."""
    result = CliRunner().invoke(program(), list(arguments))
    failed = result.exception is not None and not isinstance(result.exception, SystemExit)
    return result.exit_code, f"Traceback {result.exception!r}" if failed else result.output


def truncations(judge: Judge, findings: Findings, percents: range) -> None:
    for percent in percents:
        judge.check(judge.content[: len(judge.content) * percent // 100], f"cut at {percent} %", findings)


def corruptions(judge: Judge, kind: Damaging, count: int, seed: int, findings: Findings) -> None:
    for number in range(count):
        name = f"{kind.__name__} seed {seed} number {number}"
        judge.check(kind(judge.content, random.Random(f"{seed} {number} {kind.__name__}")), name, findings)


def _put(content: bytes, at: int, new: bytes) -> bytes:
    return content[:at] + new[: len(content) - at] + content[at + len(new) :]


def _identity(message: Recorded) -> tuple[str, int, int, int, bytes]:
    return message.topic, message.log_ns, message.publish_ns, message.sequence, message.data


def run(one: Case) -> Figures:
    """Findings of one kind of damage.  Options: every, of the cuts (%)."""
    findings = Findings()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        judge = Judge(tracked_take(folder / "take"), folder)
        if one.film == CUT:
            truncations(judge, findings, range(0, 101, one.option("every", 1)))
        else:
            corruptions(judge, NAMED[one.film], RANDOM, one.seed, findings)
    for fault in findings.faults[:20]:
        print(f"fault: {fault}")
    return findings.figures()


CUT = "cut at every 1 %"
NAMED = {kind.__name__.replace("_", " "): kind for kind in KINDS}
DAMAGE = Kind(
    "damage",
    "Takes cut at every 1 % of their length and damaged in random ways of ten kinds, read by `zenocap info` and "
    "`recover`. Faults: a traceback, a message that was never written, or the status 0 where something is lost.",
    run,
    (
        *(Quantity(name, "", 0, joined="sum") for name in ("files", "called intact")),
        Quantity("kept", "%", 0, "low"),
        Quantity("least kept", "%", 0, "low"),
        Quantity("slowest", "s", 1),
        Quantity("faults", "", 0, joined="sum"),
    ),
    {name: case(name) for name in (CUT, *NAMED)},
    case(CUT, every=50),
    seeds=4,
    rows="damage",
)
