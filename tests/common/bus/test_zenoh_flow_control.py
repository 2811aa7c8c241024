"""Counts of the messages that a query of the flow control waits for."""

import logging
from threading import Condition

from zenocap.common.bus.inbox import Inbox
from zenocap.common.bus.zenoh_flow_control import MAX_KEYS, Tally
from zenocap.common.topics import SIGHTING


def test_invented_keys_displace_no_count_of_the_rig() -> None:
    """Every query then waited for its longest time."""
    tally = Tally(Inbox(logging.getLogger("test.tally"), "r", [("viewer", "1")]), Condition())
    keys = [SIGHTING.at("r", viewer=str(number)) for number in range(MAX_KEYS + 2, 0, -1)]
    for key in keys:
        tally.count(SIGHTING, key)
    assert [key for key in keys if not tally.has({key: 1})] == [SIGHTING.at("r", viewer="2")]
