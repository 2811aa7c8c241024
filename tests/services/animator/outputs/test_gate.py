"""The gate of the Foxglove output: limits, origins, and answers with a reason."""

import gc
import logging
import socket
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tests.common.web.test_access import SPARE, few_descriptors, wait_for_descriptors
from tests.support.bare_connections import bare_connections
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.rig.animator import FoxgloveTable
from zenocap.common.web.parameters import MAX_WAITING
from zenocap.services.animator.outputs import gate as gate_module
from zenocap.services.animator.outputs.foxglove import FoxgloveOutput
from zenocap.services.animator.parameters import MAX_FOXGLOVE_CLIENTS, MAX_HANDSHAKE_BYTES


@pytest.fixture
def output() -> Iterator[FoxgloveOutput]:
    table = FoxgloveTable(port=free_ports(1)[0], origins=("https://rig.example",))
    with closing(FoxgloveOutput(table, "studio")) as one:
        yield one


def port_of(output: FoxgloveOutput) -> int:
    return int(output.title.rpartition(":")[2])


def connected(output: FoxgloveOutput, origin: str | None = None) -> ClientConnection:
    return connect(output.title.split()[1], subprotocols=[Subprotocol("foxglove.sdk.v1")], origin=origin, close_timeout=0.2)  # type: ignore[arg-type]


def answer_to(output: FoxgloveOutput, data: bytes) -> bytes:
    """Everything that comes back until the connection is closed."""
    with socket.create_connection(("127.0.0.1", port_of(output)), 10) as one:
        one.sendall(data)
        found = b""
        while piece := one.recv(4096):
            found += piece
        return found


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="lists the open files of the process in /proc")
def test_a_thousand_connections_without_a_request_keep_no_program_out(output: FoxgloveOutput) -> None:
    with few_descriptors(SPARE), bare_connections("127.0.0.1", port_of(output), 1000) as count:
        assert count == 1000
        wait_for_descriptors(3 * MAX_WAITING)
        with connected(output) as client:
            assert "serverInfo" in str(client.recv(timeout=60))
        assert output.counts()["displaced"] >= 1000 - MAX_WAITING


def test_a_request_that_is_not_completed_is_closed(output: FoxgloveOutput, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gate_module, "HANDSHAKE_TIMEOUT_S", 0.2)
    assert answer_to(output, b"GET / HTTP/1.1\r\n") == b""
    assert output.counts()["timed_out"] == 1


@pytest.mark.parametrize("origin", [None, "https://rig.example", "http://localhost:8080", "http://127.0.0.1:3000"])
def test_programs_and_allowed_pages_may_connect(output: FoxgloveOutput, origin: str | None) -> None:
    with connected(output, origin) as client:
        assert "serverInfo" in str(client.recv(timeout=60))


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "http://127.0.0.1.evil.example",
        "null",
        "http://localhost.evil",
        "http://[",
        "http://localhost@evil.example",
        "ftp://localhost",
    ],
)
def test_pages_of_other_sites_are_refused_with_a_reason(output: FoxgloveOutput, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403") as raised, connected(output, origin):
        pass
    assert b"animator.foxglove.origins" in (raised.value.response.body or b"")
    assert output.counts()["refused"] == 1


def test_a_page_of_a_name_that_now_leads_here_is_refused(output: FoxgloveOutput) -> None:
    """DNS rebinding: host and origin agree, and the browser takes this server for the site of an attacker."""
    site = f"evil.example:{port_of(output)}"
    request = f"GET / HTTP/1.1\r\nHost: {site}\r\nOrigin: http://{site}\r\nUpgrade: websocket\r\n\r\n"
    assert answer_to(output, request.encode()).startswith(b"HTTP/1.1 403 Forbidden")
    assert output.counts()["refused"] == 1


def test_programs_beyond_the_maximum_are_refused_with_a_reason(output: FoxgloveOutput) -> None:
    with ExitStack() as stack:
        for _ in range(MAX_FOXGLOVE_CLIENTS):
            stack.enter_context(connected(output)).recv(timeout=60)
        with pytest.raises(InvalidStatus, match="503") as raised, connected(output):
            pass
        assert f"{MAX_FOXGLOVE_CLIENTS} programs are connected already".encode() in (raised.value.response.body or b"")


@pytest.mark.parametrize(
    "data", [b"\x16\x03\x01\x1b[31m\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n", b"x" * 2 * MAX_HANDSHAKE_BYTES]
)
def test_malformed_requests_get_an_answer_and_one_log_line(
    output: FoxgloveOutput, caplog: pytest.LogCaptureFixture, data: bytes
) -> None:
    with caplog.at_level(logging.WARNING):
        for _ in range(5):
            with suppress(ConnectionResetError):  # the rest of a long request was not read
                assert answer_to(output, data).startswith(b"HTTP/1.1 400 Bad Request")
    assert output.counts()["malformed"] == 5
    assert len(caplog.records) == 1


def test_a_browser_that_opens_the_address_is_told_what_it_is(output: FoxgloveOutput) -> None:
    found = answer_to(output, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    assert found.startswith(b"HTTP/1.1 426 Upgrade Required")
    assert b"Foxglove" in found


@pytest.mark.slow
def test_closing_ends_all_connections_without_a_word(output: FoxgloveOutput, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING), connected(output) as client, socket.create_connection(client.remote_address):
        client.recv(timeout=60)
        output.close()
        gc.collect()  # a task that was left pending is reported when it is collected
    assert not [record for record in caplog.records if record.name == gate_module.__name__]
