"""Lower priority of programs that only read a rig.

On Linux two values count.  The nice value of a thread orders the threads of one session.  Where the kernel groups tasks by
session (autogroup, the default of most desktop systems), sessions share the processor by the value in
`/proc/self/autogroup`.  `nice` alone then changes nothing between services: each has a session of its own.  Within a
control group, such as a container or a unit of systemd, only the group's weight counts against other groups.
"""

import logging
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

NICENESS = 10  # about a tenth of the weight of a service; with 16 readers p99 39 ms instead of 166; chosen by hand
AUTOGROUP = Path("/proc/self/autogroup")
TRIES, BETWEEN_S = 20, 0.11  # the kernel takes one change of any unprivileged process in 0.1 s


def lower_priority(logger: logging.Logger) -> None:
    """Lower the priority of this process, its threads and the processes that it starts, for good.

    A lower one that it already has is kept.  The session's value is changed only by a process that leads its session: in
    the session of a terminal it would slow down all that runs there.  What the system refuses is logged in one line.
    """
    if not hasattr(os, "setpriority"):
        logger.warning("priority not lowered: this system has no nice values")
        return
    try:
        for thread in _threads():
            if os.getpriority(os.PRIO_PROCESS, thread) < NICENESS:
                os.setpriority(os.PRIO_PROCESS, thread, NICENESS)
    except OSError as error:
        logger.warning("priority not lowered: nice value %d: %s", NICENESS, error.strerror)
    try:
        if AUTOGROUP.is_file() and session_niceness(AUTOGROUP.read_text()) < NICENESS:
            if os.getsid(0) == os.getpid():
                _write(AUTOGROUP, time.sleep)
            else:
                logger.info("priority lowered only against programs started from the same terminal")
    except OSError as error:
        logger.warning("priority not lowered against other sessions: %s: %s", AUTOGROUP, error.strerror)


def session_niceness(text: str) -> int:
    """Nice value in `/proc/self/autogroup`, such as `/autogroup-602 nice 0`; NICENESS for a text without one."""
    _, found, value = text.rpartition(" nice ")
    return int(value) if found else NICENESS


def _threads() -> list[int]:
    """Thread ids of this process on Linux, where each has a nice value; elsewhere 0, the process."""
    if sys.platform != "linux":
        return [0]
    return [int(name) for name in os.listdir("/proc/self/task")]


def _write(path: Path, wait: Callable[[float], None]) -> None:
    """Write NICENESS, again while the kernel refuses because another process has just done so.  Raises OSError."""
    for left in reversed(range(TRIES)):
        try:
            path.write_text(str(NICENESS))
            return
        except BlockingIOError:
            if not left:
                raise
            wait(BETWEEN_S)
