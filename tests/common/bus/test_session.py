"""Zenoh's configuration: defaults, the user's file and options, errors; end of a session; free ports."""

import errno
import json
import logging
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from threading import Event
from unittest.mock import Mock

import pytest
import zenoh

from tests.support.live_cameras import until
from tests.support.networks import free_endpoint, listener
from tests.support.processes import PATIENCE_S
from zenocap.common.bus import zenoh_session
from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_router import router
from zenocap.common.bus.zenoh_session import HOST, PORTS, ZenohOptions, configuration, free_ports, open_session
from zenocap.common.closable import Closable
from zenocap.common.runtime.clock import ManualClock, RealClock


def setting(options: ZenohOptions, key: str) -> object:
    return json.loads(configuration(options).get_json(key))


def test_default_configuration_is_tuned_for_a_rig() -> None:
    assert setting(ZenohOptions(), "transport/link/tx/lease") == 2000
    assert setting(ZenohOptions(), "connect/timeout_ms") == -1
    assert setting(ZenohOptions(), "connect/exit_on_failure") is False
    assert setting(ZenohOptions(), "connect/retry")["period_max_ms"] == 500
    assert setting(ZenohOptions(), "transport/shared_memory/enabled") is False


def test_options_are_written_to_zenohs_configuration() -> None:
    options = ZenohOptions("client", ("tcp/a:1", "tcp/b:2"), ("tcp/0.0.0.0:3",), multicast_scouting=False)
    assert setting(options, "mode") == "client"
    assert setting(options, "connect/endpoints") == ["tcp/a:1", "tcp/b:2"]
    assert setting(options, "listen/endpoints") == ["tcp/0.0.0.0:3"]
    assert setting(options, "scouting/multicast/enabled") is False


def test_file_overrides_defaults_and_options_override_the_file(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{ mode: "client", transport: { link: { tx: { lease: 5000 } } } }  // JSON5')
    assert setting(ZenohOptions(config_file=file), "transport/link/tx/lease") == 5000
    assert setting(ZenohOptions(config_file=file), "mode") == "client"
    assert setting(ZenohOptions(config_file=file), "connect/timeout_ms") == -1
    assert setting(ZenohOptions("peer", config_file=file), "mode") == "peer"


@pytest.mark.parametrize("content", [None, "", "{ mode: ", '{ mode: "boss" }', "{ no_such_key: 1 }"])
def test_error_names_the_missing_or_invalid_file(tmp_path: Path, content: str | None) -> None:
    file = tmp_path / "zenoh.json5"
    if content is not None:
        file.write_text(content)
    with pytest.raises(BusError, match=r"zenoh\.json5: no Zenoh configuration"):
        configuration(ZenohOptions(config_file=file))


@pytest.mark.parametrize("endpoint", ["", "localhost", "localhost:7447", "tcp/", "/x", 'tcp/"'])
def test_error_names_the_invalid_endpoint(endpoint: str) -> None:
    with pytest.raises(BusError, match=r"connect/endpoints = .*PROTOCOL/ADDRESS expected"):
        configuration(ZenohOptions(connect=(endpoint,)))


def test_an_invalid_mode_and_an_unknown_protocol_raise_an_error() -> None:
    with pytest.raises(BusError, match=r"mode.*boss"):
        configuration(ZenohOptions("boss"))
    with pytest.raises(BusError, match=r"Zenoh does not open .*carrier/pigeon:1"):
        open_session(ZenohOptions("peer", listen=("carrier/pigeon:1",), multicast_scouting=False))


class Panic(BaseException):
    """That of Rust, which is no Exception."""


def test_a_panic_of_zenoh_is_an_error_with_its_text(monkeypatch: pytest.MonkeyPatch) -> None:
    def panic(config: zenoh.Config) -> zenoh.Session:
        raise Panic("no file descriptors")

    monkeypatch.setattr(zenoh, "open", panic)
    with pytest.raises(BusError, match=r"Zenoh does not open .*: no file descriptors$"):
        open_session(ZenohOptions("peer", multicast_scouting=False))


@pytest.mark.core
def test_an_address_in_use_raises_an_error() -> None:
    with socket.socket() as occupied:
        occupied.bind(("127.0.0.1", 0))
        occupied.listen()
        endpoint = f"tcp/127.0.0.1:{occupied.getsockname()[1]}"
        with pytest.raises(BusError, match=rf"does not open .*listen {endpoint}"):
            open_session(ZenohOptions("peer", listen=(endpoint,), multicast_scouting=False))


@pytest.mark.core
def test_a_client_without_a_router_waits_until_stopped() -> None:
    stop_requested = iter([False, False, True])
    with pytest.raises(BusError, match=r"stopped while waiting for a Zenoh router at tcp/127\.0\.0\.1:1"):
        open_session(ZenohOptions("client", ("tcp/127.0.0.1:1",), multicast_scouting=False), lambda: next(stop_requested))


@pytest.mark.core
def test_a_router_runs_until_stopped() -> None:
    stop_requested = iter([False] * 20 + [True] * 100)
    options = ZenohOptions(listen=("tcp/127.0.0.1:0",), multicast_scouting=False)
    assert router(lambda _: options, lambda: next(stop_requested)) is None


@pytest.mark.core
def test_a_peer_says_that_it_has_reached_no_participant_and_when_it_does(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A false address of a peer was never named: the service ran alone."""
    caplog.set_level(logging.INFO, logger="zenocap")
    monkeypatch.setattr(zenoh_session, "REACH_S", 0.3)
    endpoint = free_endpoint()

    def logged(word: str) -> bool:
        lone.receive(0.05)
        return word in caplog.text

    with ZenohBus.open(ZenohOptions("peer", (endpoint,), multicast_scouting=False), "studio", RealClock()) as lone:
        until(lambda: logged(f"no other participant reached at {endpoint}"), "nothing was logged")
        with ZenohBus.open(listener(endpoint), "studio", RealClock()):
            until(lambda: logged("reached another participant after"), "nothing was logged")
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]


MEMBERS = {"bus": lambda session: ZenohBus(session, "studio", ManualClock(1)), "film": FilmSession}


@pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS)
def test_a_router_that_hangs_delays_the_end_by_a_limit(
    monkeypatch: pytest.MonkeyPatch, member: Callable[[object], Closable]
) -> None:
    """It kept every service, and the launcher, for 7 s."""
    monkeypatch.setattr(zenoh_session, "CLOSE_S", 0.05)
    released, left = Event(), []
    session = Mock(is_closed=Mock(return_value=False), close=lambda: left.append(released.wait(PATIENCE_S)))
    with member(session):
        pass
    assert left == []
    released.set()
    until(lambda: left == [True], "it was not closed")


def test_what_was_declared_ends_before_its_session() -> None:
    session = Mock(is_closed=Mock(return_value=False))
    declared = [session.first, session.second]
    session.first.undeclare.side_effect = zenoh.ZError("the session is closed")
    zenoh_session.close_session(session, declared)
    assert [call[0] for call in session.mock_calls] == ["first.undeclare", "second.undeclare", "is_closed", "close"]


def test_free_ports_differ_and_are_none_that_a_system_gives_away() -> None:
    found = free_ports(20)
    assert len(set(found)) == 20
    assert set(found) <= set(PORTS)
    with socket.socket() as any_port:
        any_port.bind((HOST, 0))
        assert any_port.getsockname()[1] not in PORTS


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE])
def test_a_full_table_of_open_files_is_not_taken_for_ports_in_use(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def full(address: tuple[str, int]) -> socket.socket:
        raise OSError(number, "Too many open files")

    monkeypatch.setattr(socket, "create_server", full)
    with pytest.raises(BusError, match=r"^8 free TCP ports: Too many open files: allowed: a higher limit: ulimit -n$"):
        free_ports(8)


def test_ports_in_use_and_named_ones_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    (one,) = free_ports(1)
    monkeypatch.setattr("zenocap.common.bus.zenoh_session.PORTS", range(one, one + 1))
    assert free_ports(1) == [one]
    with pytest.raises(BusError, match="1 free TCP ports: 0 found"):
        free_ports(1, named=[one])
    with socket.socket() as user:
        user.bind((HOST, one))
        with pytest.raises(BusError, match="0 found"):
            free_ports(1)


class SlowZenoh:
    """`zenoh.open` that waits for `there`, and the sessions that it has opened."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.there, self.calls, self.sessions = threading.Event(), 0, list[Mock]()
        self._before = set(threading.enumerate())
        monkeypatch.setattr(zenoh, "open", self._open)
        monkeypatch.setattr(zenoh_session._Opening, "_left", [])

    @property
    def waiting(self) -> int:
        """Number of threads that wait."""
        return len([one for one in threading.enumerate() if one.name == "zenoh-open" and one not in self._before])

    def _open(self, config: zenoh.Config) -> Mock:
        self.calls += 1
        self.there.wait(60.0)
        self.sessions.append(Mock(**{"is_closed.return_value": False}))
        return self.sessions[-1]


def left(options: ZenohOptions) -> None:
    """Begin to open a session, and stop."""
    with pytest.raises(BusError, match="stopped while waiting"):
        open_session(options, lambda: True)


HERE, ELSEWHERE = (ZenohOptions("client", (f"tcp/{HOST}:{port}",), multicast_scouting=False) for port in (2, 3))


def test_what_waits_for_a_router_and_was_left_ends_without_a_session(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each click on Try of the teaching page left a thread, and a runtime of Zenoh, for ever."""
    slow = SlowZenoh(monkeypatch)
    for options in (HERE, HERE, ELSEWHERE, HERE):
        left(options)
    until(lambda: slow.calls == 2, "a thread has not begun")
    assert (slow.waiting, slow.calls) == (2, 2)
    slow.there.set()
    until(lambda: [one.close.call_count for one in slow.sessions] == [1, 1], "a session is open")
    until(lambda: not slow.waiting, "a thread still waits")


def test_the_next_session_with_the_same_options_waits_for_what_was_left(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = SlowZenoh(monkeypatch)
    left(HERE)
    asked = iter([False, False])

    def stopped() -> bool:
        if next(asked, None) is None:
            slow.there.set()
        return False

    session = open_session(HERE, stopped)
    assert (slow.calls, session) == (1, slow.sessions[0])
    session.close.assert_not_called()
    assert open_session(HERE) is not session  # it has left the list


def test_two_sessions_with_the_same_options_wait_each_for_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    slow, found = SlowZenoh(monkeypatch), list[object]()
    threads = [threading.Thread(target=lambda: found.append(open_session(HERE))) for _ in range(2)]
    for thread in threads:
        thread.start()
    until(lambda: slow.calls == 2, "one waits for the session of the other")
    slow.there.set()
    for thread in threads:
        thread.join()
    assert len({id(one) for one in found}) == 2


@pytest.mark.core
def test_a_router_that_comes_later_keeps_no_session_that_was_left(monkeypatch: pytest.MonkeyPatch) -> None:
    opened, really_open = list[zenoh.Session](), zenoh.open

    def recorded(config: zenoh.Config) -> zenoh.Session:
        opened.append(really_open(config))
        return opened[-1]

    monkeypatch.setattr(zenoh, "open", recorded)
    before, endpoint = set(threading.enumerate()), f"tcp/{HOST}:{free_ports(1)[0]}"

    def waiting() -> int:
        return len([one for one in threading.enumerate() if one.name == "zenoh-open" and one not in before])

    for _ in range(3):
        left(ZenohOptions("client", (endpoint,), multicast_scouting=False))
    assert waiting() == 1
    with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
        until(lambda: not waiting(), "a thread still waits")
        until(lambda: sorted(session.is_closed() for session in opened) == [False, True], "what was left is open")
