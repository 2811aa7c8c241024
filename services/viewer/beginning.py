"""When videos and the actor begin: all viewers of a rig agree, whoever starts first, and one that comes back joins.

Each proposes a time a little ahead in its camera message, again and again until it has heard all others; then the latest
proposal holds.  A time that lies in the past is no proposal: that viewer has begun.
"""

import logging
from collections.abc import Callable, Collection

from common.bus.protocol import Bus, Envelope
from common.messages import CameraInfo
from common.runtime.clock import Clock
from common.topics import CAMERA

logger = logging.getLogger(__name__)

LEAD_NS = 1_500_000_000  # of a proposal
AGAIN_NS = 400_000_000  # between two proposals; less than the lead, so that none of them gets old
SETTLE_NS = 300_000_000  # for proposals that were under way
PATIENT_NS = 3_000_000_000  # before saying whom it waits for


def agreed_epoch(
    others: Collection[str], propose: Callable[[int], CameraInfo], bus: Bus, clock: Clock, stopped: Callable[[], bool]
) -> int:
    """Capture time of frame 0, the same in every viewer, nanoseconds.

    others: ids of the rig's other viewers.  propose: this viewer's camera message with such a time.
    """
    bus.subscribe(CAMERA)
    heard: dict[str, int] = {}
    own_ns, proposed_ns, settled_ns = 0, 0, None
    tell_ns: int | None = clock.now_ns() + PATIENT_NS
    while not stopped():
        now_ns = clock.now_ns()
        if settled_ns is None and set(others) <= heard.keys() and own_ns:
            settled_ns = now_ns + SETTLE_NS
        if settled_ns is None and now_ns - proposed_ns >= AGAIN_NS:
            own_ns, proposed_ns = now_ns + LEAD_NS, now_ns
            bus.publish(CAMERA, propose(own_ns))
        if settled_ns is not None and now_ns >= settled_ns:
            return max(own_ns, *heard.values()) if heard else own_ns
        match bus.receive(0.1):
            case Envelope(message=CameraInfo(viewer=viewer, captured_ns=captured_ns), received_ns=received_ns):
                if viewer in others and captured_ns <= received_ns:
                    logger.info("joins viewer %s, which began %.1f s ago", viewer, (received_ns - captured_ns) / 1e9)
                    return captured_ns
                if viewer in others:
                    heard[viewer] = captured_ns
            case None if tell_ns is not None and now_ns >= tell_ns and settled_ns is None:
                tell_ns = None
                logger.info("waiting for viewer %s, to begin together", ", ".join(sorted(set(others) - heard.keys())))
    return clock.now_ns()
