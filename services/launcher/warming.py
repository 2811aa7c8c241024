"""Compiling before the services start: in processes of their own, side by side, so that all others load the result."""

import subprocess
import sys
import time
from collections.abc import Callable

from rich.console import Console
from rich.status import Status

from services.warmup import PARTS

QUICK_S = 6.0  # loading what is compiled already takes less: nothing to say
LOOK_S = 0.05


def compile_first(
    has_actor: bool, has_tracker: bool, has_recognizer: bool, stopped: Callable[[], bool], console: Console
) -> bool:
    """Compile what a rig needs, saying so if it takes a while; False when stopped or failed, which is printed."""
    needed = {"actor": has_actor, "tracker": has_tracker, "tracking": not has_tracker, "recognizer": has_recognizer}
    unused = {"pictures"} | {part for part, wanted in needed.items() if not wanted}
    longest, *others = sorted((part for part in PARTS if part not in unused), key=lambda part: not part.startswith("track"))
    running = [
        subprocess.Popen(
            [sys.executable, "-P", "-m", "services.cli", "warmup", *(word for part in parts for word in ("--part", part))],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        for parts in ([longest], others)
    ]
    started_s, said = time.monotonic(), False
    status = Status("starting ...", console=console)
    try:
        with status:
            while any(process.poll() is None for process in running):
                if stopped():
                    return False
                elapsed_s = time.monotonic() - started_s
                if elapsed_s > QUICK_S:
                    status.update(f"compiling (first run only) ... {elapsed_s:.0f} s")
                    if not said and not console.is_terminal:
                        console.print("compiling (first run only), some 20 s ...", markup=False)
                        console.file.flush()
                    said = True
                time.sleep(LOOK_S)
    finally:
        for process in running:
            if process.poll() is None:
                process.terminate()
            process.wait()
    for process in running:
        if process.returncode != 0 and process.stderr is not None:
            console.print(f"error: compiling failed:\n{process.stderr.read().strip()}", markup=False)
            return False
    if said:
        console.print(f"compiled in {time.monotonic() - started_s:.0f} s", markup=False, highlight=False)
    return True
