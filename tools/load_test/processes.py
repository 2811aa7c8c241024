"""Processor time, memory and handles of processes and of the machine, by psutil."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import psutil

SHARED_MEMORY = Path("/dev/shm")
ProcessKey = tuple[str, str, str]  # rig, service, id; rig "" for the router and the measuring process
ITSELF: ProcessKey = ("", "measuring", "main")


@dataclass(frozen=True)
class Sample:
    """Resources of one process.  processor_s: since its start.  memory_bytes: resident, without shared memory (films).

    handles: open files and sockets; 0 where the system does not count them.
    """

    pid: int
    at_s: float
    processor_s: float
    memory_bytes: int
    handles: int
    threads: int


@dataclass(frozen=True)
class Machine:
    """processor_s: processor time used since the machine's start on all cores, out of all_s."""

    processor_s: float
    all_s: float


def sample(pids: Mapping[ProcessKey, int]) -> dict[ProcessKey, Sample]:
    """Samples of the processes that exist."""
    found = {}
    for key, pid in pids.items():
        try:
            found[key] = _sample(psutil.Process(pid))
        except (psutil.NoSuchProcess, psutil.AccessDenied, psutil.ZombieProcess):
            continue
    return found


def _sample(process: psutil.Process) -> Sample:
    with process.oneshot():
        times, memory = process.cpu_times(), process.memory_info()
        handles = process.num_fds() if hasattr(process, "num_fds") else 0
        return Sample(
            process.pid, time.monotonic(), times.user + times.system, memory.rss - getattr(memory, "shared", 0), handles,
            process.num_threads(),
        )  # fmt: skip


def machine() -> Machine:
    times = psutil.cpu_times()
    everything = sum(times) - getattr(times, "guest", 0.0) - getattr(times, "guest_nice", 0.0)  # those are in user
    return Machine(everything - times.idle - getattr(times, "iowait", 0.0), everything)


def cores() -> int:
    return psutil.cpu_count() or 1


def shared_memory() -> tuple[int, int]:
    """Bytes and files in shared memory; 0 and 0 where there is no such folder."""
    if not SHARED_MEMORY.is_dir():
        return 0, 0
    sizes = []
    for path in SHARED_MEMORY.iterdir():
        try:
            sizes.append(path.stat().st_size)
        except OSError:  # removed meanwhile
            continue
    return sum(sizes), len(sizes)
