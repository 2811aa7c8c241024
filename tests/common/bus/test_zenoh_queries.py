"""ZenohClock: the answer that is used, of several."""

import logging
from unittest.mock import Mock

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.bus.zenoh_queries import ZenohClock
from zenocap.common.messages import ClockQuery
from zenocap.common.runtime.clock import ManualClock

MS = 1_000_000


def test_a_late_answer_with_the_middle_of_its_trip_is_not_preferred() -> None:
    """It seemed to be without any difference of the clocks, and moved the time of all others by half a second."""
    clock, session, inbox = ManualClock(10_000 * MS), Mock(), Inbox(logging.getLogger("test"))
    times = ZenohClock(session, "studio", clock, inbox)
    times.query()
    handler = session.get.call_args.args[1]
    assert isinstance(handler, zenoh.handlers.Callback)
    for after_ms, answered_ms in ((2, 10_004), (900, 10_451)):
        clock.advance(after_ms * MS)
        data = codec.encode(ClockQuery(frame=1, captured_ns=answered_ms * MS))
        handler(Mock(ok=Mock(payload=Mock(to_bytes=lambda data=data: data))))
    handler.drop()
    assert times.integrator_ns() - clock.now_ns() == 3 * MS
    assert inbox.counters.rejected == {"names": 1}
