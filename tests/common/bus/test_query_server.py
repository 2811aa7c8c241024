"""Answers to the queries on one key, and their end."""

from threading import Event
from unittest.mock import MagicMock, Mock

import pytest
from zenoh import ZBytes

from tests.support.processes import PATIENCE_S
from zenocap.common import codec
from zenocap.common.bus import zenoh_query_server
from zenocap.common.bus.zenoh_query_server import WAITING, QueryServer
from zenocap.common.messages import FilmQuery, FilmReply


def test_the_end_does_not_wait_for_the_next_look_at_the_film(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each camera of a machine kept the end for a quarter of a second, one after the other."""
    monkeypatch.setattr(zenoh_query_server, "IDLE_S", PATIENCE_S)
    session, looked = Mock(), Event()
    server = QueryServer(session, "a/key", FilmQuery, Mock(), looked.set)
    _, ask = session.declare_queryable.call_args.args
    ask(MagicMock(payload=None))
    assert looked.wait(PATIENCE_S)
    server.undeclare()
    assert not server._thread.is_alive()


def test_a_flood_of_queries_keeps_nobody_who_films_from_an_answer() -> None:
    """After ten seconds without one the film ended."""
    session, begun, goes_on, done, asked = Mock(), Event(), Event(), Event(), list[str]()

    def answer(query: FilmQuery) -> FilmReply:
        begun.set()
        assert goes_on.wait(PATIENCE_S)
        asked.append(query.sender)
        if len(asked) == 1 + 2 * WAITING:
            done.set()
        return FilmReply(frame=0, captured_ns=0, host="lab1", state="filming")

    server = QueryServer(session, "a/key", FilmQuery, answer, first=lambda: "0f3a")
    _, ask = session.declare_queryable.call_args.args
    others, own = (
        MagicMock(payload=ZBytes(codec.encode(FilmQuery(frame=0, captured_ns=0, what="state", sender=who))))
        for who in ("others", "0f3a")
    )
    ask(others)
    assert begun.wait(PATIENCE_S)
    for query in (others, own):
        for _ in range(10 * WAITING):
            ask(query)
    goes_on.set()
    assert done.wait(PATIENCE_S)
    server.undeclare()
    assert asked == ["others", *["0f3a"] * WAITING, *["others"] * WAITING]
    assert (others.drop.call_count, own.drop.call_count) == (9 * WAITING, 9 * WAITING)
