"""Common start time of videos and of the simulated person in all viewers of a rig.

Each viewer proposes a time slightly ahead in its camera message, repeatedly, until it has the proposals of all others; then
the latest one is the epoch.  A proposal in the past is from a viewer that has already started; a restarted viewer uses it.
"""

import logging
from collections.abc import Callable, Collection

from zenocap.common.bus.protocol import Bus, Envelope
from zenocap.common.messages import CameraInfo
from zenocap.common.runtime.clock import Clock
from zenocap.common.topics import CAMERA
from zenocap.services.viewer.parameters import EPOCH_LEAD_NS, EPOCH_REPEAT_NS, EPOCH_REPORT_NS, EPOCH_SETTLE_NS

logger = logging.getLogger(__name__)


def agreed_epoch(
    others: Collection[str], propose: Callable[[int], CameraInfo], bus: Bus, clock: Clock, stopped: Callable[[], bool]
) -> int:
    """Capture time of frame 0, the same in every viewer, nanoseconds since the Unix epoch.

    others: ids of the other viewers of the rig.  propose: camera message of this viewer with a proposed time.
    """
    bus.subscribe(CAMERA)
    proposals: dict[str, int] = {}
    own_ns, proposed_ns, settled_ns = 0, 0, None
    report_ns: int | None = clock.now_ns() + EPOCH_REPORT_NS
    while not stopped():
        now_ns = clock.now_ns()
        if settled_ns is None and set(others) <= proposals.keys() and own_ns:
            settled_ns = now_ns + EPOCH_SETTLE_NS
        if settled_ns is None and now_ns - proposed_ns >= EPOCH_REPEAT_NS:
            own_ns, proposed_ns = now_ns + EPOCH_LEAD_NS, now_ns
            bus.publish(CAMERA, propose(own_ns))
        if settled_ns is not None and now_ns >= settled_ns:
            return max(own_ns, *proposals.values()) if proposals else own_ns
        match bus.receive(0.1):
            case Envelope(message=CameraInfo(viewer=viewer, captured_ns=captured_ns), received_ns=received_ns):
                if viewer in others and captured_ns <= received_ns:
                    logger.info("joining viewer %s, which started %.1f s ago", viewer, (received_ns - captured_ns) / 1e9)
                    return captured_ns
                if viewer in others:
                    proposals[viewer] = captured_ns
            case None if report_ns is not None and now_ns >= report_ns and settled_ns is None:
                report_ns = None
                logger.info(
                    "waiting for viewer %s to start at the same time", ", ".join(sorted(set(others) - proposals.keys()))
                )
    return clock.now_ns()
