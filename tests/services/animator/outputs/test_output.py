"""UDP sender: receivers that listen, end, return or do not exist; no blocking."""

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.support.command_receivers import udp_receiver
from zenocap.services.animator.outputs.output import QUIET_DATAGRAMS, DatagramSender, OutputError


@contextmanager
def sender(port: int, host: str = "127.0.0.1") -> Iterator[DatagramSender]:
    one = DatagramSender("animator.udp", host, port)
    yield one
    one.close()


def port_of(receiver: socket.socket) -> int:
    return receiver.getsockname()[1]


def test_datagrams_arrive() -> None:
    with udp_receiver() as receiver, sender(port_of(receiver), "localhost") as to:
        to.send(b"one")
        assert receiver.recv(100) == b"one"
        assert to.counts == {"sent": 1}


def test_a_receiver_that_ended_is_logged_once_and_served_again_when_it_is_back(caplog: pytest.LogCaptureFixture) -> None:
    with udp_receiver() as receiver:
        port = port_of(receiver)
    with sender(port) as to:
        for _ in range(20):
            to.send(b"lost")
        with udp_receiver(port) as receiver:
            to.send(b"after")
            assert receiver.recv(100) == b"after"
            for _ in range(QUIET_DATAGRAMS):
                to.send(b"between")
        assert to.counts["refused"] > 15
        line = f"animator.udp 127.0.0.1:{port}: no program listens at this address; sending continues"
        assert [record.getMessage() for record in caplog.records] == [line]
        for _ in range(3):
            to.send(b"lost")
        assert [record.getMessage() for record in caplog.records] == [line] * 2, "again after many successes"


def test_datagrams_to_a_receiver_that_never_reads_are_sent_or_dropped() -> None:
    with udp_receiver() as receiver, sender(port_of(receiver)) as to:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for _ in range(5000):
            to.send(b"x" * 1000)
        assert to.counts["sent"] + to.counts["dropped"] == 5000


def test_a_datagram_that_is_too_large_is_counted_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    with sender(9) as to:
        to.send(b"x" * 70_000)
        assert to.counts["failed"] == 1
    assert "cannot be sent to: Message too long" in caplog.text


@pytest.mark.parametrize("host", ["no.such.host.invalid", ".."])
def test_an_unknown_host_is_an_error_at_once(host: str) -> None:
    with pytest.raises(OutputError, match=re.escape(f"animator.vmc.host = {host!r}: the address cannot")):
        DatagramSender("animator.vmc", host, 39539)


def test_broadcast_addresses_are_allowed() -> None:
    with sender(39600, "127.255.255.255") as to:
        to.send(b"to all")
        assert to.counts["sent"] + to.counts["refused"] >= 1
