"""A running rig: each service as a process on a separate host, and an observer on one more host."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import msgspec

from benchmarks.faults.measures import ReceivedMessage, Window, recovery_ns
from benchmarks.faults.network import Network
from zenocap.common.rig.rig import demo_rig_file

ROOT = Path(__file__).resolve().parents[2]
PORT = 7447
ROUTER, INTEGRATOR, OBSERVER = "router", "integrator", "observer"
PATIENCE_S = 5.0


class RigError(RuntimeError):
    """The rig does not track; the text has the last health messages."""


def rig_file(folder: Path, name: str, method: str, viewers: int, fps: float, router: str) -> Path:
    """Write a rig of the simulated person to `folder`; its services are clients of a router."""
    source = "demo" if method == "two-view" else "ring"
    shutil.copy(demo_rig_file("two-view").with_name(f"{source}-calibration.toml"), folder / "calibration.toml")
    tables = "".join(
        f'[[viewer]]\nid = "{n}"\ncamera = "cam{n:02d}"\nsource = "actor:demo?seed=4"\nbackground = "first:30"\n'
        f"size = [160, 120]\nfps = {fps:g}\n"
        for n in range(1, viewers + 1)
    )
    path = folder / "rig.toml"
    path.write_text(
        f'name = "{name}"\ncalibration = "calibration.toml"\nmethod = "{method}"\n[recognizer]\nmodel = "fifteen"\n'
        f'[zenoh]\nmode = "client"\nconnect = ["tcp/{router}:{PORT}"]\nmulticast_scouting = false\n{tables}',
        encoding="utf-8",
    )
    return path


class RunningRig:
    """Processes of a rig; a context manager.  A host is named after its service, "viewer-ID" for viewers."""

    def __init__(self, network: Network, folder: Path, file: Path, rig_name: str, fps: float) -> None:
        self.network, self.folder, self.file, self.rig_name, self.fps = network, folder, file, rig_name, fps
        self.received: list[ReceivedMessage] = []
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._starts = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for selected in (lambda name: name not in (ROUTER, INTEGRATOR), lambda name: name == INTEGRATOR, lambda _: True):
            self._stop([name for name in self._processes if selected(name)])

    @property
    def endpoint(self) -> str:
        return f"tcp/{self.network.address(ROUTER)}:{PORT}"

    def start(self, name: str, arguments: Sequence[str] | None = None) -> None:
        """Start a service on its host.  arguments: Python arguments that replace the service's."""
        listening = name == OBSERVER
        self._starts += 1
        with (self.folder / f"{self._starts:02d}-{name}.log").open("wb") as log_file:
            process = subprocess.Popen(
                self.network.command(name, [sys.executable, "-P", *(arguments or self._arguments(name))]),
                cwd=ROOT,
                env=os.environ | {"PYTHONPATH": str(ROOT)},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE if listening else subprocess.DEVNULL,
                stderr=log_file,
            )
        self._processes[name] = process
        if process.stdout is not None:
            threading.Thread(target=self._listen, args=(process.stdout,), daemon=True).start()

    def kill(self, name: str) -> None:
        process = self._processes.pop(name)
        process.kill()
        process.wait()

    def freeze(self, name: str) -> None:
        self._processes[name].send_signal(signal.SIGSTOP)

    def thaw(self, name: str) -> None:
        self._processes[name].send_signal(signal.SIGCONT)

    def wait(self, condition: Callable[[], bool], seconds: float, description: str) -> float:
        """Wait until `condition` holds; return the elapsed time (s).  Raises StageError after `seconds`."""
        start_s = time.monotonic()
        while not condition():
            ended = [name for name, process in self._processes.items() if process.poll() is not None]
            if ended or time.monotonic() - start_s > seconds:
                reason = f"{', '.join(ended)} ended" if ended else f"not within {seconds:g} s"
                states = {event.sender: event.state for event in list(self.received) if event.topic == "health"}
                raise RigError(f"{description}: {reason}; last received: {states}; see {self.folder}")
            time.sleep(0.05)
        return time.monotonic() - start_s

    def settled_since(self, begin_ns: int) -> bool:
        """Whether consecutive poses from all viewers have arrived since then."""
        poses = [event for event in list(self.received) if event.received_ns >= begin_ns]
        return recovery_ns(poses, Window(begin_ns, begin_ns, time.time_ns())) is not None

    def _arguments(self, name: str) -> list[str]:
        service, _, id = name.partition("-")
        if name == OBSERVER:
            return ["-m", "benchmarks.faults.observer", self.rig_name, self.endpoint]
        command = ["-m", "zenocap", service]
        if name == ROUTER:
            return [*command, "-l", self.endpoint, "--no-multicast-scouting"]
        own = {"viewer": ["--id", id], INTEGRATOR: ["-o", str(self.folder / "take.mcap")], "animator": ["--port", "0"]}
        return [*command, str(self.file), "--with-parent", *own.get(service, [])]

    def _listen(self, stream: IO[bytes]) -> None:
        decoder = msgspec.json.Decoder(ReceivedMessage)
        with (self.folder / f"{self._starts:02d}-received.jsonl").open("wb") as file:
            for line in stream:
                self.received.append(decoder.decode(line))
                file.write(line)

    def _stop(self, names: Sequence[str]) -> None:
        running = {name: self._processes.pop(name) for name in names}
        for process in running.values():
            process.send_signal(signal.SIGCONT)
            process.terminate()
        for process in running.values():
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
