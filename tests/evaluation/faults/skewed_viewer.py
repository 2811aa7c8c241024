"""A viewer on a machine whose clock is wrong: the camera films at the true time, its frames are stamped by the wrong clock.

python -m tests.evaluation.faults.skewed_viewer RIG ID ENDPOINT OFFSET_S DRIFT
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime import logs
from common.runtime.clock import RealClock
from common.runtime.rig import load_rig
from common.runtime.service import run
from common.runtime.signals import stop_signals
from services.viewer.beginning import agreed_epoch
from services.viewer.ready import load_compiled
from services.viewer.shell import camera_info, viewer_service
from services.viewer.source import open_source
from services.viewer.sources.frame import Frame, Playback


class SkewedClock:
    """offset_s: ahead of the true clock at the start.  drift: seconds gained per second."""

    def __init__(self, offset_s: float, drift: float) -> None:
        self._true = RealClock()
        self._start_ns, self._offset_ns, self._drift = self._true.now_ns(), int(offset_s * 1e9), drift

    def now_ns(self) -> int:
        return self.at(self._true.now_ns())

    def elapsed_ns(self) -> int:
        return self._true.elapsed_ns()

    def at(self, true_ns: int) -> int:
        """What this clock shows at a true time."""
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
        return run(service, bus, wrong, frames, stopped, greeting=(camera_info(viewer, epoch_ns),))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
