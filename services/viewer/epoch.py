"""Common start time of videos and of the simulated person in all viewers of a rig.

Each viewer proposes a time slightly ahead in its camera message, repeatedly, until it has the proposals of all others; then
the latest one is the epoch.  A proposal in the past is from a viewer that has already started; a restarted viewer uses it.
One far ahead, or longer ago than its viewer runs, is of a wrong clock or of another program: it is named and ignored.
"""

import logging
from collections.abc import Callable, Mapping

from zenocap.common.bus.protocol import Bus, Envelope
from zenocap.common.messages import CameraInfo
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.topics import CAMERA
from zenocap.services.viewer import parameters as p

logger = logging.getLogger(__name__)


def agreed_epoch(
    others: Mapping[str, Callable[[], int]], propose: Callable[[int], CameraInfo], bus: Bus, clock: Clock,
    stopped: Callable[[], bool],
) -> int:  # fmt: skip
    """Capture time of frame 0, the same in every viewer, nanoseconds since the Unix epoch.

    others: by id of the other viewers of the rig, longest time from frame 0 to the end of each, nanoseconds.
    propose: camera message of this viewer with a proposed time.
    """
    bus.subscribe(CAMERA)
    log_once = OncePerSource(logger)
    proposals: dict[str, int] = {}
    own_ns, proposed_ns, settled_ns = 0, 0, None
    report_ns: int | None = clock.elapsed_ns() + p.EPOCH_REPORT_NS
    while not stopped():
        now_ns = clock.elapsed_ns()  # the clock of the proposals may be set
        if settled_ns is None and set(others) <= proposals.keys() and own_ns:
            settled_ns = now_ns + p.EPOCH_SETTLE_NS
        if settled_ns is None and (not own_ns or now_ns - proposed_ns >= p.EPOCH_REPEAT_NS):
            own_ns, proposed_ns = clock.now_ns() + p.EPOCH_LEAD_NS, now_ns
            bus.publish(CAMERA, propose(own_ns))
        if settled_ns is not None and now_ns >= settled_ns:
            return max(own_ns, *proposals.values()) if proposals else own_ns
        if report_ns is not None and now_ns >= report_ns and settled_ns is None:
            report_ns = None
            missing = ", ".join(sorted(set(others) - proposals.keys()))
            logger.info("waiting for viewer %s to start at the same time", missing)
        match bus.receive(0.1):
            case Envelope(message=CameraInfo(viewer=viewer) as info, received_ns=received_ns) if viewer in others:
                ago_ns = received_ns - info.captured_ns
                if 0 <= ago_ns <= others[viewer]():
                    logger.info("joining viewer %s, which started %.1f s ago", viewer, ago_ns / 1e9)
                    return info.captured_ns
                if -p.EPOCH_AHEAD_NS <= ago_ns < 0:
                    proposals[viewer] = info.captured_ns
                else:
                    log_once.warn(f"viewer {viewer}", "start", _refusal(ago_ns, others[viewer]()))
    return clock.now_ns()


def _refusal(ago_ns: int, lasts_ns: int) -> str:
    """Why a start is ignored."""
    return (
        f"a start {abs(ago_ns) / 1e9:.1f} s {'ahead' if ago_ns < 0 else 'ago'} is ignored: allowed: at most "
        f"{p.EPOCH_AHEAD_NS / 1e9:.0f} s ahead or {lasts_ns / 1e9:.0f} s ago; a clock is wrong, or another program sends it"
    )
