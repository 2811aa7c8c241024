"""Answers to the queries on one key, and their end."""

from threading import Event
from unittest.mock import MagicMock, Mock

import pytest

from tests.support.processes import PATIENCE_S
from zenocap.common.bus import zenoh_query_server
from zenocap.common.bus.zenoh_query_server import QueryServer
from zenocap.common.messages import FilmQuery


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
