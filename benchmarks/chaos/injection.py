"""Injection of one fault into a running rig, and its end."""

import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from benchmarks.chaos.observer import Observer
from benchmarks.chaos.page_visitors import visit
from benchmarks.chaos.running_rig import RunningRig
from benchmarks.chaos.schedule import MACHINE, ROUTER, Fault
from tests.support.places import ROOT

End = Callable[[], None]
ORDER_PAUSE_S = (0.3, 1.5)  # between two random requests
OBEYED_S = 1.2  # the log obeys one request a second
STEP_S = 1.0, 4.0  # by which a clock is set, either way
ENDS_S = 20.0  # longest wait for the end of a service after SIGTERM: the launcher would kill it then
FILLER = "filler"


class Injector:
    """Begins faults.  disk: mount point of a small disk that holds the recordings; None where none can be mounted."""

    def __init__(self, rig: RunningRig, rig_name: str, observer: Observer, disk: Path | None) -> None:
        self._rig, self._rig_name, self._observer, self._disk = rig, rig_name, observer, disk
        self.deleted_ns: list[int] = []
        self.restore_log = False  # a user starts the recording again after the fault

    def prepare(self, fault: Fault, rng: random.Random) -> Callable[[], End]:
        """Prepare what takes time; returns the function that begins the fault, which returns the one that ends it."""
        if fault.kind in ("flood", "forgery"):
            return self._flood(fault, rng)
        return lambda: self._begin(fault, rng)

    def _begin(self, fault: Fault, rng: random.Random) -> End:
        rig = self._rig
        match fault.kind, fault.target:
            case "kill", service:
                rig.kill(service)
                return rig.start_router if service == ROUTER else lambda: None
            case "terminate", service:
                pid = rig.pid(service)
                rig.kill(service, signal.SIGTERM)

                def ended() -> None:
                    rig.wait(lambda: rig.pid(service) != pid, ENDS_S)

                return ended
            case "stop", service:
                pid = rig.pid(service)
                rig.signal(pid, signal.SIGSTOP)
                return lambda: rig.signal(pid, signal.SIGCONT)
            case "cut" | "disconnect", service:
                rig.gate.cut(service, "silent" if fault.kind == "cut" else "reset")
                return lambda: rig.gate.restore(service)
            case "clock", whose:
                pid = 0 if whose == MACHINE else rig.pid(whose)
                if pid is not None:
                    rig.step_clock(pid, round(rng.choice((-1, 1)) * rng.uniform(*STEP_S) * 1e9))
                return lambda: rig.step_clock(0, 0)
            case "page", kind:
                return self._visits(kind, rng)
            case "full disk", _:
                return self._fill()
            case "recordings", how:
                self._remove(how)
                return lambda: None
            case "requests", _:
                return self._orders(rng)
        raise ValueError(f"{fault.kind}: no such fault")

    def log_again(self) -> None:
        """Start the recording as a user would after a full disk or a stopped log: end it, and begin a new one."""
        for what in ("stop_recording", "record"):
            self._observer.request(what)
            time.sleep(OBEYED_S)
        self.restore_log = False

    def _flood(self, fault: Fault, rng: random.Random) -> Callable[[], End]:
        seed = str(rng.randrange(1 << 30))
        arguments = [fault.target, self._rig_name, self._rig.endpoint, f"{fault.seconds}", seed]
        process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.chaos.hostile", *arguments],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        if process.stdout.readline().strip() != "ready":
            raise RuntimeError(f"hostile {fault.target}: {process.communicate()[1]}")
        begin = process.stdin

        def end() -> None:
            with suppress(ValueError, subprocess.TimeoutExpired):
                process.communicate(timeout=20.0)
            process.kill()
            process.wait()

        def start() -> End:
            begin.write("go\n")
            begin.flush()
            return end

        return start

    def _visits(self, kind: str, rng: random.Random) -> End:
        ended = threading.Event()
        arguments = (kind, self._rig.page_port, rng, ended)
        thread = threading.Thread(target=visit, args=arguments, daemon=True)
        thread.start()

        def end() -> None:
            ended.set()
            thread.join(10.0)

        return end

    def _fill(self) -> End:
        assert self._disk is not None  # drawn only where there is one
        filler = self._disk / FILLER
        with suppress(OSError), filler.open("wb", buffering=0) as file:
            while True:
                file.write(bytes(1 << 16))
        self.restore_log = True
        return lambda: filler.unlink(missing_ok=True)

    def _remove(self, how: str) -> None:
        recordings = self._rig.recordings
        if not recordings.exists():
            return
        if how == "deleted":
            self.deleted_ns.append(time.time_ns())
            shutil.rmtree(recordings, ignore_errors=True)
        else:
            recordings.rename(recordings.with_name(f"moved-{time.time_ns()}"))

    def _orders(self, rng: random.Random) -> End:
        ended = threading.Event()

        def orders() -> None:
            while not ended.wait(rng.uniform(*ORDER_PAUSE_S)):
                self._observer.request(rng.choice(("record", "stop_recording")))

        thread = threading.Thread(target=orders, daemon=True)
        thread.start()
        self.restore_log = True

        def end() -> None:
            ended.set()
            thread.join(5.0)

        return end
