"""Minutes of the targets of make: python -m tests.measures.minutes [--cases NAME,...] [--publish]

The cases are run one after another in clones of the last commit: cold ones in a new clone each time, warm ones in one that
has run `make test` before.  Results are added to minutes.json beside this file, with the end of each part; --publish writes
the table of CONTRIBUTING.md.
"""

import argparse
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tests.support.places import ROOT, SHARED
from zenocap.common.processor import processor

RESULTS = Path(__file__).with_name("minutes.json")
PAGE = ROOT / "CONTRIBUTING.md"
BUSY = "while True: pass"
BEGIN, END = "<!-- minutes -->\n", "<!-- end of minutes -->\n"
# Name: command, and text of the table.  Cold cases run in a clone of their own, without any cache.
COLD = {
    "demo-cold": (("make", "demo", "ARGS=--no-page --seconds 20"), "`make demo`, the first time, until a pose is shown"),
    "test-cold": (("make", "test"), "`make test`, the first time on a machine"),
    "ci-cold": (("bash", ".ci/run"), "`.ci/run`, the first time on a machine"),
}
WARM = {
    "test-unit": (("make", "test-unit"), "`make test-unit`"),
    "test": (("make", "test"), "`make test`"),
    "test-core": (("make", "test-core"), "`make test-core`"),
    "test-nightly": (("make", "test-nightly"), "`make test-nightly`"),
}
# Ends of parts, as the first line that matches; the seconds of demo-cold are those of its last part.
PARTS = {
    "packages": r"^compiling |^Installing development tools", "kernels": r"^compiled in", "checks": r"^Success: no issues",
    "first pose": r" s \| .*°", "make test": r"^make test .*: \d+ s$", "make docs": r"^make docs: \d+ s$",
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", default=",".join([*COLD, *WARM]), help="comma-separated (default: all)")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--load", nargs="?", const=BUSY, metavar="COMMAND",
        help="beside a process for each core that never waits, or beside COMMAND, which is run again when it ends",
    )  # fmt: skip
    parser.add_argument("--publish", action="store_true", help="write the table of CONTRIBUTING.md")
    chosen = parser.parse_args(arguments)
    cases = [name for name in chosen.cases.split(",") if name]
    if unknown := sorted({*cases} - {*COLD, *WARM}):
        parser.error(f"--cases {unknown[0]}: allowed: {', '.join([*COLD, *WARM])}")
    status = 0
    with beside(chosen.load):
        for row in measured(cases, chosen.rounds, load=chosen.load is not None):
            print(json.dumps(row), flush=True)
            rows = [*json.loads(RESULTS.read_text()), row] if RESULTS.exists() else [row]
            RESULTS.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")
            status = status or int(str(row["status"]))
    if chosen.publish:
        PAGE.write_text(with_table(PAGE.read_text(), json.loads(RESULTS.read_text())))
    return status


def measured(cases: Sequence[str], rounds: int, *, load: bool) -> Iterator[Mapping[str, object]]:
    """Run each case `rounds` times, in clones of the last commit."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, check=True, capture_output=True, text=True)
    for name in [name for name in cases if name in COLD] * rounds:
        with clone() as folder:
            row = {"commit": commit.stdout.strip(), **timed(name, COLD[name][0], folder, load=load)}
        yield row
        if name == "ci-cold" and "make test" in row["parts"]:  # which is that of a newcomer
            yield row | {"case": "test-cold", "seconds": row["parts"]["make test"], "within": "ci-cold"}
    warm = [name for name in cases if name in WARM]
    if warm and rounds:
        with clone() as folder:
            run(("make", "test"), folder)  # fills the caches
            for name in warm * rounds:
                yield {"commit": commit.stdout.strip(), **timed(name, WARM[name][0], folder, load=load)}


@contextmanager
def clone() -> Iterator[Path]:
    """The last commit in another folder, with the test data beside it if it is here, and caches of its own."""
    with tempfile.TemporaryDirectory(prefix="zenocap-minutes-") as folder:
        subprocess.run(["git", "clone", "-q", str(ROOT), f"{folder}/main"], check=True)
        if SHARED.is_dir():
            (Path(folder) / "shared").symlink_to(SHARED)
        yield Path(folder) / "main"


def run(command: Sequence[str], folder: Path) -> tuple[int, list[tuple[float, str]]]:
    """Run a command; its exit status, and the lines of its output with the seconds after which they came."""
    caches = {"ZENOCAP_CACHE": "zenocap", "UV_CACHE_DIR": "uv", "PIP_CACHE_DIR": "pip"}
    own = ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS")
    environment = {name: value for name, value in os.environ.items() if name not in own}
    environment |= {name: str(folder.parent / "caches" / value) for name, value in caches.items()}
    start_s = time.monotonic()
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, errors="replace",
    ) as process:  # fmt: skip
        assert process.stdout is not None
        lines = [(time.monotonic() - start_s, line) for line in process.stdout]
    return process.returncode, lines


def parts_of(lines: Sequence[tuple[float, str]]) -> dict[str, float]:
    """Seconds after which each part was done."""
    found = {}
    for name, pattern in PARTS.items():
        done = [seconds for seconds, line in lines if re.search(pattern, line)]
        if done:
            found[name] = round(done[0], 1)
    return found


@contextmanager
def beside(load: str | None, number: int = os.cpu_count() or 1) -> Iterator[None]:
    """Meanwhile the other work runs, or `number` processes that never wait, one a core by default, or nothing for None."""
    count = number if load == BUSY else 0 if load is None else 1
    command = [sys.executable, "-c", BUSY] if load == BUSY else ["bash", "-c", f"while true; do {load}; done"]
    log = ROOT / "build" / "minutes" / "beside.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("a") as file:
        busy = [subprocess.Popen(command, stdout=file, stderr=file, start_new_session=True) for _ in range(count)]
        try:
            yield
        finally:
            for process in busy:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def timed(name: str, command: Sequence[str], folder: Path, *, load: bool) -> dict[str, Any]:
    start_s = time.monotonic()
    status, lines = run(command, folder)
    seconds = time.monotonic() - start_s
    text, parts = "".join(line for _, line in lines), parts_of(lines)
    log = ROOT / "build" / "minutes" / f"{name}-{'load' if load else 'alone'}-{datetime.now(UTC):%H%M%S}.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text(text)
    if name == "demo-cold":
        seconds, status = parts.get("first pose", seconds), status if "first pose" in parts else 1
    tests = re.findall(r"^(\d+ (?:passed|failed).*?)(?: in [\d.]+s.*)?$", text, re.MULTILINE)
    return {
        "case": name, "load": load, "seconds": round(seconds, 1), "status": status, "tests": "; ".join(tests),
        "parts": parts, "date": f"{datetime.now(UTC):%Y-%m-%d}", "cores": os.cpu_count(), "processor": processor(),
    }  # fmt: skip


def with_table(page: str, rows: Sequence[Mapping[str, object]]) -> str:
    """The page with the medians of the last commit that each case was measured on, alone and beside load."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    if not after:
        raise ValueError(f"{PAGE.name}: the lines {BEGIN.strip()} and {END.strip()} are missing")
    head = "| command | minutes | runs, commit | beside other work on all cores | runs, commit |\n"
    lines = [head, "|---|--:|---|--:|---|\n"]
    for name, (_, text) in {**COLD, **WARM}.items():
        cells = []
        for load in (False, True):
            own = [row for row in rows if row["case"] == name and row["status"] == 0 and row["load"] is load]
            last = [row for row in own if row["commit"] == own[-1]["commit"]]
            seconds = [float(str(row["seconds"])) for row in last]
            cells += [f"{statistics.median(seconds) / 60:.1f}", f"{len(last)}, {last[0]['commit']}"] if last else ["", ""]
        if any(cells):
            lines.append(f"| {' | '.join([text, *cells])} |\n")
    return before + BEGIN + "".join(lines) + END + after


if __name__ == "__main__":
    sys.exit(main())
