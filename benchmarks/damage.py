"""Takes cut at every 1 % of their length and damaged at random: results of reading, `info` and `recover`.

    python -m benchmarks.damage [--count N] [--seeds 0 1 2 3] [--commands N]

Each damaged file must be rejected or read within seconds, without a traceback; the exit status may be 0 only when nothing
is lost; messages read must equal messages written; and recovered files must be intact for the reader of the mcap package.
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

from benchmarks.mixture import tracked_take
from benchmarks.table import table
from zenocap.common.recording.reader import Recorded, Take
from zenocap.tools.cli.main import program

Damaging = Callable[[bytes, random.Random], bytes]
PATIENCE_S = 20.0  # time limit of one command on one file (s)


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
    chunks = [at for at in _places(content, b"\x04\0\0\0zstd") if content[at - 37 : at - 36] == b"\x06"]
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

    def row(self, name: str) -> list[str | int | float]:
        shares = self.shares or [0.0]
        statuses = ", ".join(f"{info}/{recover}: {count}" for (info, recover), count in sorted(self.statuses.items()))
        worst, mean = 100 * min(shares), 100 * sum(shares) / len(shares)
        return [name, self.files, statuses, mean, worst, self.slowest_s, len(self.faults)]


class Judge:
    """Compares damaged copies of a take with the take."""

    def __init__(self, take: Path, folder: Path) -> None:
        self.content = take.read_bytes()
        whole = Take(take)
        self._messages = list(whole.messages())
        self._known = Counter(_identity(message) for message in self._messages)
        self._rest = (whole.attachments, whole.metadata)
        self._path, self._output = folder / "damaged.mcap", folder / "recovered.mcap"

    def check(self, content: bytes, name: str, findings: Findings, run: Callable[..., tuple[int, str]]) -> None:
        """Run info and recover on `content` and check both results."""
        self._path.write_bytes(content)
        self._output.unlink(missing_ok=True)
        found: list[int] = []
        for arguments in (["info", str(self._path)], ["recover", str(self._path), "-o", str(self._output)]):
            started_s = time.monotonic()
            status, output = run(*arguments)
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
        take = Take(self._output)
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


def as_process(*arguments: str) -> tuple[int, str]:
    """Exit status and output of a command run as a process."""
    command = [sys.executable, "-m", "zenocap", *arguments]
    run = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    return run.returncode, run.stdout + run.stderr


def truncations(judge: Judge, findings: Findings, percents: range = range(0, 101)) -> None:
    for percent in percents:
        judge.check(judge.content[: len(judge.content) * percent // 100], f"cut at {percent} %", findings, in_process)


def corruptions(judge: Judge, kind: Damaging, count: int, seed: int, findings: Findings) -> None:
    for number in range(count):
        name = f"{kind.__name__} seed {seed} number {number}"
        judge.check(kind(judge.content, random.Random(f"{seed} {number} {kind.__name__}")), name, findings, in_process)


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
        groups = [("cut at every 1 %", cuts)]
        for kind in KINDS:
            findings = Findings()
            for seed in seeds:
                corruptions(judge, kind, -(-count // len(KINDS) // len(seeds)), seed, findings)
            groups.append((kind.__name__.replace("_", " "), findings))
        by_command = Findings()
        for number in range(commands):
            kind, rng = KINDS[number % len(KINDS)], random.Random(f"command {number}")
            judge.check(kind(judge.content, rng), f"command {number}", by_command, as_process)
        groups.append(("some of each kind, as commands", by_command))
        for name, findings in groups:
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
