"""A viewer on a machine with a wrong clock: frames are captured at the true time and stamped by the wrong clock.

python -m benchmarks.faults.skewed_viewer RIG ID ENDPOINT OFFSET_S DRIFT
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.rig.rig import load_rig
from zenocap.common.runtime import logs
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.service import run
from zenocap.common.runtime.signals import stop_signals
from zenocap.services.viewer.epoch import agreed_epoch
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.jit_warmup import load_compiled
from zenocap.services.viewer.shell import camera_info, viewer_service
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source


class SkewedClock:
    """A wrong clock.  offset_s: ahead of the true clock at the start.  drift: seconds gained per second."""

    def __init__(self, offset_s: float, drift: float) -> None:
        self._true = RealClock()
        self._start_ns, self._offset_ns, self._drift = self._true.now_ns(), int(offset_s * 1e9), drift

    def now_ns(self) -> int:
        return self.at(self._true.now_ns())

    def elapsed_ns(self) -> int:
        return self._true.elapsed_ns()

    def at(self, true_ns: int) -> int:
        """Reading of this clock at a true time."""
        return true_ns + self._offset_ns + int((true_ns - self._start_ns) * self._drift)


def stamped(frames: Iterator[Frame], clock: SkewedClock) -> Iterator[Frame]:
    for frame in frames:
        yield replace(frame, captured_ns=clock.at(frame.captured_ns))


def main(rig_path: str, id: str, endpoint: str, offset_s: str, drift: str) -> int:
    logs.configure(f"viewer {id}, clock off by {offset_s} s")
    rig = load_rig(Path(rig_path), files=False)
    viewer = rig.viewer(id)
    service = viewer_service(viewer)
    load_compiled(service.setup)
    true, wrong = RealClock(), SkewedClock(float(offset_s), float(drift))
    options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
    with stop_signals(with_parent=True) as stopped, ZenohBus.open(options, rig.name, wrong, stopped) as bus:
        with bus.reader() as others:
            ids = [other.id for other in rig.viewers if other is not viewer]
            epoch_ns = agreed_epoch(ids, partial(camera_info, viewer), others, true, stopped)
        frames = stamped(open_source(viewer, Playback(epoch_ns, true)), wrong)
        return run(service, bus, wrong, frames, stopped, first_messages=(camera_info(viewer, epoch_ns),))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
