"""Clock that can be set, of every Python process that finds this module.

The file CHAOS_CLOCK has a process id, 0 for all, and the nanoseconds by which its clock is ahead.
"""

import mmap
import os
import struct
import time

with open(os.environ["CHAOS_CLOCK"], "rb") as file:
    _shared = mmap.mmap(file.fileno(), 16, prot=mmap.PROT_READ)
_now_ns = time.time_ns


def _stepped_ns() -> int:
    pid, ahead_ns = struct.unpack("qq", _shared)
    return _now_ns() + (ahead_ns if pid in (0, os.getpid()) else 0)


time.time_ns, time.time = _stepped_ns, lambda: _stepped_ns() / 1e9
