"""Takes cut at every 1 % of their length and damaged at random: what reading, `info` and `recover` make of them.

    python -m tests.evaluation.damage [--count N] [--seeds 0 1 2 3] [--commands N]

Each damaged file must be refused or read without a traceback and within seconds; the exit status must be 0 only when
nothing is lost; whatever is read must be what was written; and what is recovered must be whole for mcap's own reader.
"""

import argparse
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from mcap.reader import make_reader
from typer.testing import CliRunner

from common.take.reading import Recorded, Take
from services.cli import app
from tests.evaluation.mixture import tracked_take
from tests.evaluation.table import table

Damaging = Callable[[bytes, random.Random], bytes]
PATIENCE_S = 20.0  # for one command on one file


def flip_bit(content: bytes, chance: random.Random) -> bytes:
    return _put(content, at := chance.randrange(len(content)), bytes([content[at] ^ 1 << chance.randrange(8)]))


def flip_some(content: bytes, chance: random.Random) -> bytes:
    for _ in range(chance.randint(2, 50)):
        content = flip_bit(content, chance)
    return content


def overwrite(content: bytes, chance: random.Random) -> bytes:
    return _put(content, chance.randrange(len(content)), chance.randbytes(chance.randint(1, 5000)))


def zero(content: bytes, chance: random.Random) -> bytes:
    """As a disk does with blocks that never reached it."""
    return _put(content, chance.randrange(len(content)) // 4096 * 4096, bytes(4096 * chance.randint(1, 8)))


def leave_out(content: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(content))
    return content[:at] + content[at + chance.randint(1, 50_000) :]


def put_in(content: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(content))
    return content[:at] + chance.randbytes(chance.randint(1, 5000)) + content[at:]


def wrong_length(content: bytes, chance: random.Random) -> bytes:
    """A length at the head of a chunk, of the data in it or of what it unpacks to."""
    chunks = [at for at in _places(content, b"\x04\0\0\0zstd") if content[at - 37 : at - 36] == b"\x06"]
    at = chance.choice(chunks) + chance.choice((-36, 8, -12))
    value = chance.choice((0, 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, chance.randrange(len(content))))
    return _put(content, at, value.to_bytes(8, "little"))


def beginning(content: bytes, chance: random.Random) -> bytes:
    return _put(content, 0, chance.randbytes(chance.randint(1, 2000)))


def end(content: bytes, chance: random.Random) -> bytes:
    size = chance.randint(1, 2000)
    return content[:-size] + chance.randbytes(size)


def repeat(content: bytes, chance: random.Random) -> bytes:
    start = chance.randrange(len(content))
    stretch = content[start : start + chance.randint(1, 20_000)]
    return _put(content, chance.randrange(len(content)), stretch)


KINDS: tuple[Damaging, ...] = (
    flip_bit, flip_some, overwrite, zero, leave_out, put_in, wrong_length, beginning, end, repeat,
)  # fmt: skip


@dataclass
class Findings:
    """What came out.  statuses: of info and recover.  faults: what must not be."""

    files: int = 0
    statuses: Counter[tuple[int, int]] = field(default_factory=Counter)
    shares: list[float] = field(default_factory=list)
    slowest_s: float = 0.0
    faults: list[str] = field(default_factory=list)

    def row(self, name: str) -> list[str | int | float]:
        shares = self.shares or [0.0]
        statuses = ", ".join(f"{info}/{recover}: {count}" for (info, recover), count in sorted(self.statuses.items()))
        worst, mean = 100 * min(shares), 100 * sum(shares) / len(shares)
        return [name, self.files, statuses, mean, worst, self.slowest_s, len(self.faults)]


class Judge:
    """Knows the whole take, and looks at damaged copies of it in a folder."""

    def __init__(self, take: Path, folder: Path) -> None:
        self.content = take.read_bytes()
        whole = Take(take)
        self._messages = list(whole.messages())
        self._known = Counter(_identity(message) for message in self._messages)
        self._rest = (whole.attachments, whole.metadata)
        self._path, self._output = folder / "damaged.mcap", folder / "recovered.mcap"

    def look(self, content: bytes, name: str, findings: Findings, run: Callable[..., tuple[int, str]]) -> None:
        """Run info and recover on `content` and judge both."""
        self._path.write_bytes(content)
        self._output.unlink(missing_ok=True)
        found: list[int] = []
        for arguments in (["info", str(self._path)], ["recover", str(self._path), "-o", str(self._output)]):
            started_s = time.monotonic()
            status, said = run(*arguments)
            findings.slowest_s = max(findings.slowest_s, time.monotonic() - started_s)
            found.append(status)
            if "Traceback" in said or status not in (0, 1, 3):
                findings.faults.append(f"{name}: {arguments[0]}: status {status}: {said[-300:]}")
        info, recovered = found
        findings.files += 1
        findings.statuses[info, recovered] += 1
        if (info == 0) != (content == self.content):
            findings.faults.append(f"{name}: info {info}")
        if recovered == 1:
            if self._output.exists():
                findings.faults.append(f"{name}: nothing to recover, but a file is left")
            return
        self._judge(name, recovered, findings)

    def _judge(self, name: str, status: int, findings: Findings) -> None:
        take = Take(self._output)
        said = list(take.messages())
        findings.shares.append(len(said) / len(self._messages))
        if {_identity(each) for each in said} - self._known.keys():
            findings.faults.append(f"{name}: a message that was never written")
        if status == 0 and (said != self._messages or self._rest != (take.attachments, take.metadata)):
            findings.faults.append(f"{name}: something is lost, and status 0")
        if take.cut:
            findings.faults.append(f"{name}: what was recovered is not whole: {take.cut}")
        with self._output.open("rb") as file:
            summary = make_reader(file, validate_crcs=True).get_summary()
            if summary is None or summary.statistics is None or summary.statistics.message_count != len(said):
                findings.faults.append(f"{name}: mcap's own reader finds another summary")


def in_process(*arguments: str) -> tuple[int, str]:
    """Exit status and output of a command run here."""
    result = CliRunner().invoke(app, list(arguments))
    trouble = result.exception is not None and not isinstance(result.exception, SystemExit)
    return result.exit_code, f"Traceback {result.exception!r}" if trouble else result.output


def as_process(*arguments: str) -> tuple[int, str]:
    """The same by the real command line."""
    command = [sys.executable, "-m", "services.cli", *arguments]
    run = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    return run.returncode, run.stdout + run.stderr


def truncations(judge: Judge, findings: Findings, percents: range = range(0, 101)) -> None:
    for percent in percents:
        judge.look(judge.content[: len(judge.content) * percent // 100], f"cut at {percent} %", findings, in_process)


def corruptions(judge: Judge, kind: Damaging, count: int, seed: int, findings: Findings) -> None:
    for number in range(count):
        name = f"{kind.__name__} seed {seed} number {number}"
        judge.look(kind(judge.content, random.Random(f"{seed} {number} {kind.__name__}")), name, findings, in_process)


def _put(content: bytes, at: int, new: bytes) -> bytes:
    return content[:at] + new[: len(content) - at] + content[at + len(new) :]


def _places(content: bytes, what: bytes) -> list[int]:
    places, at = [], content.find(what)
    while at >= 0:
        places.append(at)
        at = content.find(what, at + 1)
    return places


def _identity(message: Recorded) -> tuple[str, int, int, int, bytes]:
    return message.topic, message.log_ns, message.publish_ns, message.sequence, message.data


def main(count: int, seeds: list[int], commands: int) -> int:
    rows, faults = [], []
    with tempfile.TemporaryDirectory() as folder:
        judge = Judge(tracked_take(), Path(folder))
        cuts = Findings()
        truncations(judge, cuts)
        every = [("cut at every 1 %", cuts)]
        for kind in KINDS:
            findings = Findings()
            for seed in seeds:
                corruptions(judge, kind, -(-count // len(KINDS) // len(seeds)), seed, findings)
            every.append((kind.__name__.replace("_", " "), findings))
        real = Findings()
        for number in range(commands):
            kind, chance = KINDS[number % len(KINDS)], random.Random(f"command {number}")
            judge.look(kind(judge.content, chance), f"command {number}", real, as_process)
        every.append(("some of each, by the command line", real))
        for name, findings in every:
            rows.append(findings.row(name))
            faults += findings.faults
    columns = ["damage", "files", "exit status info/recover", "kept %", "least %", "slowest s", "faults"]
    print(table(f"Damaged takes, {len(judge.content)} bytes each, seeds {seeds}", columns, rows))
    for fault in faults[:20]:
        print(f"fault: {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3])
    parser.add_argument("--commands", type=int, default=10)
    options = parser.parse_args()
    sys.exit(main(options.count, options.seeds, options.commands))
