"""A rig of simulated cameras under `zenocap up`, with a gate between services and router."""

import os
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

import psutil

from benchmarks.chaos.gate import LinkGate
from benchmarks.chaos.schedule import ROUTER, SERVICES, VIEWERS
from tests.support.places import ROOT
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.rig.rig import demo_rig_file

UP = "up"
SAMPLE_S = 0.5  # between two looks at the processes
START_S, STOP_S = 180.0, 60.0  # until the first poses: compilation, empty scene; for `up` to stop


@dataclass
class Seen:
    """A process while it ran.  rss_bytes, files: (time, value) samples."""

    name: str
    pid: int
    first_ns: int
    rss_bytes: list[tuple[int, int]] = field(default_factory=list)
    files: list[tuple[int, int]] = field(default_factory=list)
    ended_ns: int | None = None


def rig_file(folder: Path, name: str, size: str, fps: float, seed: int, method: str = "hybrid") -> Path:
    """Write a rig of three simulated cameras, of two-view two, around the simulated person to `folder`."""
    views = 2 if method == "two-view" else len(VIEWERS)
    calibration = "demo-calibration.toml" if views == 2 else "ring-calibration.toml"
    shutil.copy(demo_rig_file("two-view").with_name(calibration), folder / "calibration.toml")
    width, height = size.split("x")
    tables = "".join(
        f'[[viewer]]\nid = "{number}"\ncamera = "cam{number:02d}"\nsource = "actor:demo?seed={seed % 16}"\n'
        f'background = "first:30"\nsize = [{width}, {height}]\nfps = {fps:g}\n'
        for number in range(1, views + 1)
    )
    path = folder / "rig.toml"
    path.write_text(
        f'name = "{name}"\ncalibration = "calibration.toml"\nmethod = "{method}"\n'
        f'[recognizer]\nmodel = "fifteen"\n{tables}',
        encoding="utf-8",
    )
    return path


class RunningRig:
    """Router, gate and `zenocap up`; a context manager.  folder: for the output.  recordings: folder of the takes."""

    def __init__(self, folder: Path, recordings: Path, file: Path) -> None:
        self.folder, self.recordings, self._file = folder, recordings, file
        self.router_port, gate_port, self.page_port = free_ports(3)
        self._gate_endpoint = f"tcp/127.0.0.1:{gate_port}"
        self.processes: dict[int, Seen] = {}
        self.killed: set[int] = set()
        self._router: subprocess.Popen[bytes] | None = None
        self._up: subprocess.Popen[bytes] | None = None
        self.gate = LinkGate(gate_port, self.router_port, self._owner, self._candidates)
        self._ended = threading.Event()
        self._monitor = threading.Thread(target=self._watch, name="monitor", daemon=True)
        self._clock = folder / "clock"
        self.step_clock(0, 0)
        self.status: int | None = None
        self.stop_s = 0.0  # that the stop took

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.router_port}"

    def __enter__(self) -> Self:
        self.start_router()
        self.gate.__enter__()
        network = ["-m", "client", "-e", self._gate_endpoint, "--no-multicast-scouting"]
        line = ["up", str(self._file), "--recordings", str(self.recordings), "--port", str(self.page_port), *network]
        self._up = self._process(line, UP)
        self._monitor.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()
        for seen in list(self.processes.values()):  # those of a launcher that did not end them
            with suppress(OSError):
                if seen.ended_ns is None and _name_of(seen.pid) == seen.name:
                    os.kill(seen.pid, signal.SIGKILL)
        self.gate.__exit__(kind, error, trace)
        if self._router is not None:
            self._router.kill()
            self._router.wait()

    def stop(self) -> None:
        """Stop the rig as Ctrl-C does, and keep the exit status of `up`."""
        self._ended.set()
        if self._monitor.is_alive():
            self._monitor.join(5.0)
        if self._up is not None and self.status is None:
            begin_s = time.monotonic()
            self._up.send_signal(signal.SIGINT)
            try:
                self.status = self._up.wait(STOP_S)
            except subprocess.TimeoutExpired:
                self._up.kill()
                self.status = self._up.wait()
            self.stop_s = time.monotonic() - begin_s

    @property
    def ended(self) -> bool:
        return self._up is not None and self._up.poll() is not None

    def wait(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Whether a condition is met within some time, while `up` runs."""
        end_s = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end_s or self.ended:
                return False
            time.sleep(0.05)
        return True

    def start_router(self) -> None:
        self._router = self._process(["router", "-l", self.endpoint, "--no-multicast-scouting"], ROUTER)

    def pid(self, service: str) -> int | None:
        """Process id of a running service; None while there is none."""
        if service == ROUTER:
            return self._router.pid if self._router is not None else None
        return next((pid for pid, name in self.children().items() if name == service), None)

    def kill(self, service: str, number: signal.Signals = signal.SIGKILL) -> None:
        pid = self.pid(service)
        if pid is None:
            return
        self.killed.add(pid)
        with suppress(ProcessLookupError):
            os.kill(pid, number)
        if service == ROUTER and self._router is not None:
            self._router.wait()

    def signal(self, pid: int | None, number: signal.Signals) -> None:
        if pid is not None:
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    @property
    def environment(self) -> dict[str, str]:
        """Of its processes, whose clock can be set."""
        places = [str(Path(__file__).with_name("stepped")), str(ROOT), os.environ.get("PYTHONPATH", "")]
        return os.environ | {"PYTHONPATH": os.pathsep.join(places), "CHAOS_CLOCK": str(self._clock)}

    def step_clock(self, pid: int, ahead_ns: int) -> None:
        """Set the clock of one process, or with 0 of all, ahead of the machine's, and that of all others right."""
        with self._clock.open("r+b" if self._clock.exists() else "wb") as file:
            file.write(struct.pack("qq", pid, ahead_ns))

    def children(self) -> dict[int, str]:
        """Running services of `up` by process id."""
        return {pid: name for pid in self._candidates() if (name := self._owner(pid)) is not None}

    def log_bytes(self) -> int:
        """Size of what the services have logged."""
        return sum(path.stat().st_size for path in self.folder.glob("*.err"))

    def log_text(self) -> str:
        return "".join(path.read_text(errors="replace") for path in sorted(self.folder.glob("*.err")))

    def output(self) -> str:
        return (self.folder / f"{UP}.out").read_text(errors="replace")

    def _process(self, arguments: list[str], name: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{name}.out").open("ab") as out, (self.folder / f"{name}.err").open("ab") as err:
            return subprocess.Popen(  # in a session of its own: Ctrl-C reaches this program only, which stops it
                [sys.executable, "-P", "-m", "zenocap", *arguments], cwd=self.folder, env=self.environment,
                stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True,
            )  # fmt: skip

    def _candidates(self) -> list[int]:
        if self._up is None:
            return []
        with suppress(psutil.NoSuchProcess):  # services are children of a fork server
            return [self._up.pid, *(one.pid for one in psutil.Process(self._up.pid).children(recursive=True))]
        return []

    def _owner(self, pid: int) -> str | None:
        name = _name_of(pid)
        return name if name in SERVICES else None

    def _watch(self) -> None:
        while not self._ended.wait(SAMPLE_S):
            running = self.children()
            for name, process in ((UP, self._up), (ROUTER, self._router)):
                if process is not None and process.poll() is None:
                    running[process.pid] = name
            now_ns = time.time_ns()
            for pid, name in running.items():
                seen = self.processes.setdefault(pid, Seen(name, pid, now_ns))
                with suppress(psutil.Error):
                    found = psutil.Process(pid)
                    seen.rss_bytes.append((now_ns, found.memory_info().rss))
                    seen.files.append((now_ns, found.num_fds()))
            for seen in self.processes.values():
                if seen.pid not in running and seen.ended_ns is None:
                    seen.ended_ns = now_ns


def _name_of(pid: int) -> str | None:
    """Service of a process by its command line: "viewer 1", "tracker"; None for others."""
    try:
        words = psutil.Process(pid).cmdline()
    except psutil.Error:
        return None
    if "zenocap" not in words:
        return None
    command = words[words.index("zenocap") + 1]
    return f"{command} {words[words.index('--id') + 1]}" if "--id" in words and command == "viewer" else command
