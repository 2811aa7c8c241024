"""Distribution of updates: each page gets the latest update of every key, at its own pace."""

import asyncio
import json

from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.web.broadcast import Broadcaster, EncodedUpdate, PageQueue
from zenocap.common.web.parameters import MAX_UNACKNOWLEDGED


def update(key: str, number: int) -> EncodedUpdate:
    return EncodedUpdate(key, str(number).encode())


def taken(page: PageQueue) -> list[int] | None:
    """Numbers that the page would be sent now; None when it is sent nothing."""
    return list(json.loads(asyncio.run(page.take()))) if page.ready.is_set() else None


def new_broadcaster() -> Broadcaster:
    return Broadcaster(asyncio.new_event_loop(), lambda: None, ("live", "take"))


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 99)), min_size=1))
def test_a_page_gets_the_latest_update_of_each_key_once(updates: list[tuple[str, int]]) -> None:
    page = PageQueue()
    for key, number in updates:
        page.put(update(key, number))
    assert sorted(taken(page) or []) == sorted(dict(updates).values())
    assert page.superseded == len(updates) - len(dict(updates))
    assert taken(page) is None


@given(st.lists(st.sampled_from(["put", "take", "acknowledge"]), max_size=60))
def test_a_page_never_has_more_than_the_maximum_of_unacknowledged_lists(steps: list[str]) -> None:
    page, number, unacknowledged, last = PageQueue(), 0, 0, 0
    for one in steps:
        if one == "put":
            number += 1
            page.put(update("pose", number))
        elif one == "take":
            got = taken(page)
            assert (got is not None) == (number > last and unacknowledged < MAX_UNACKNOWLEDGED)
            if got is not None:
                assert got == [number]  # the latest; earlier ones are skipped
                unacknowledged, last = unacknowledged + 1, number
        else:
            page.acknowledge()
            unacknowledged = max(0, unacknowledged - 1)
        assert page.unacknowledged == unacknowledged <= MAX_UNACKNOWLEDGED


def test_updates_of_a_feed_reach_its_pages_and_updates_of_no_feed_reach_all() -> None:
    broadcaster, live, take = new_broadcaster(), PageQueue("live"), PageQueue("take")
    broadcaster.add(live)
    broadcaster.add(take)
    broadcaster.put("live", (update("pose", 1),))
    broadcaster.put("take", (update("pose", 2),))
    broadcaster.put(None, (update("player", 3),))
    assert taken(live) == [1, 3]
    assert taken(take) == [2, 3]


def test_a_page_that_opens_or_changes_its_feed_gets_the_latest_updates() -> None:
    broadcaster, page = new_broadcaster(), PageQueue("live")
    broadcaster.put("live", (update("pose", 1), update("body", 7)))
    broadcaster.put("live", (update("pose", 2),))
    broadcaster.put("take", (update("pose", 9),))
    broadcaster.add(page)
    assert taken(page) == [2, 7]
    broadcaster.select_feed(page, "take")
    assert taken(page) == [9]
