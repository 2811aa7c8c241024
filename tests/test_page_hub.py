"""The newest of everything for each page, at its own pace."""

import asyncio
import json
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.animator.page.hub import MOST_PAGES, UNDER_WAY, Hub, Page, Piece


def piece(name: str, number: int) -> Piece:
    return Piece(name, str(number).encode())


def taken(page: Page) -> list[int] | None:
    """What the page would be sent now; None when it is sent nothing."""
    return list(json.loads(asyncio.run(page.take()))) if page.news.is_set() else None


def hub(opened: Callable[[], None] = lambda: None) -> Hub:
    return Hub(asyncio.new_event_loop(), opened)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 99)), min_size=1))
def test_a_page_gets_the_newest_of_each_name_once(said: list[tuple[str, int]]) -> None:
    page = Page()
    for name, number in said:
        page.put(piece(name, number))
    assert sorted(taken(page) or []) == sorted(dict(said).values())
    assert page.superseded == len(said) - len(dict(said))
    assert taken(page) is None


@given(st.lists(st.sampled_from(["say", "take", "got"]), max_size=60))
def test_a_page_is_never_further_behind_than_it_may_be(steps: list[str]) -> None:
    page, number, sent, said = Page(), 0, 0, 0
    for one in steps:
        if one == "say":
            number += 1
            page.put(piece("pose", number))
        elif one == "take":
            got = taken(page)
            assert (got is not None) == (number > said and sent < UNDER_WAY)
            if got is not None:
                assert got == [number]  # the newest, whatever was missed
                sent, said = sent + 1, number
        else:
            page.got()
            sent = max(0, sent - 1)
        assert page.behind == sent <= UNDER_WAY


def test_each_feed_has_its_own_pages_and_what_is_for_all_reaches_all() -> None:
    one, live, take = hub(), Page(), Page(feed="take")
    one.enter(live)
    one.enter(take)
    one.put("live", (piece("pose", 1),))
    one.put("take", (piece("pose", 2),))
    one.put(None, (piece("player", 3),))
    assert taken(live) == [1, 3]
    assert taken(take) == [2, 3]


def test_who_comes_or_turns_to_another_feed_gets_what_was_last_shown() -> None:
    one, page = hub(), Page()
    one.put("live", (piece("pose", 1), piece("body", 7)))
    one.put("live", (piece("pose", 2),))
    one.put("take", (piece("pose", 9),))
    one.enter(page)
    assert taken(page) == [2, 7]
    one.watch(page, "take")
    assert taken(page) == [9]


def test_the_first_page_after_none_is_told_to_the_one_who_shows() -> None:
    opened: list[int] = []
    one = hub(lambda: opened.append(1))
    first, second = Page(), Page()
    one.enter(first)
    one.enter(second)
    assert len(opened) == 1
    one.leave(first)
    one.leave(second)
    one.enter(first)
    assert len(opened) == 2


def test_there_is_a_most() -> None:
    one = hub()
    for _ in range(MOST_PAGES):
        one.enter(Page())
    with pytest.raises(ValueError, match=f"{MOST_PAGES} pages are open already"):
        one.enter(Page())
    assert one.pages == MOST_PAGES
