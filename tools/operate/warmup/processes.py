"""Compilation in two processes before the services start."""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence

from rich.console import Console
from rich.status import Status

from zenocap.common.cache import cache_folder, write_entry
from zenocap.common.runtime.compiled import is_compiled

PROCESSES = 2  # at the same time: a third one would compile the same code again
WEIGHTS = {"tracker": 5, "tracking": 4, "pictures": 2}  # durations relative to the other parts', chosen by hand
LINE_S = 10.0  # between two lines of progress without a terminal
POLL_S = 0.05


def compile_parts(parts: Sequence[str], stopped: Callable[[], bool], console: Console) -> bool:
    """Compile the `parts` that are not in the cache; False when stopped or after a failure, which is printed."""
    missing = [part for part in parts if not is_compiled(part)]
    if not missing:
        return True
    if problem := cache_problem():
        console.print(f"warning: {problem}; every service compiles for itself, at each start", markup=False)
        return True
    text = f"compiling {', '.join(missing)} (first run only, before anything else starts)"
    running = [_start(group) for group in shared_out(missing, PROCESSES)]
    started_s = line_s = time.monotonic()
    status = Status(f"{text} ...", console=console)
    try:
        with status:
            while any(process.poll() is None for process in running):
                if stopped():
                    return False
                now_s = time.monotonic()
                status.update(f"{text} ... {now_s - started_s:.0f} s")
                if now_s >= line_s and not console.is_terminal:
                    line_s += LINE_S
                    console.print(f"{text} ... {now_s - started_s:.0f} s", markup=False, highlight=False)
                    console.file.flush()
                time.sleep(POLL_S)
    finally:
        for process in running:
            if process.poll() is None:
                process.terminate()
            process.wait()
    for process in running:
        if process.returncode != 0 and process.stderr is not None:
            console.print(f"error: compiling failed:\n{process.stderr.read().strip()}", markup=False)
            return False
    console.print(f"compiled in {time.monotonic() - started_s:.0f} s", markup=False, highlight=False)
    return True


def cache_problem() -> str | None:
    """Reason why nothing that is compiled can be kept; None when it can."""
    folder = cache_folder()
    if write_entry(folder / "writable", b""):
        return None
    return f"the cache {folder} cannot be written: allowed: ZENOCAP_CACHE = a folder that can be written"


def shared_out(parts: Sequence[str], count: int) -> list[list[str]]:
    """Split the parts into at most `count` groups of about equal duration, the longest first."""
    groups: list[list[str]] = [[] for _ in range(min(count, len(parts)))]
    for part in sorted(parts, key=_weight, reverse=True):
        min(groups, key=lambda group: sum(map(_weight, group))).append(part)
    return groups


def _weight(part: str) -> int:
    return WEIGHTS.get(part, 1)


def _start(parts: Sequence[str]) -> subprocess.Popen[str]:
    options = [word for part in parts for word in ("--part", part)]
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "zenocap", "warmup", *options], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
