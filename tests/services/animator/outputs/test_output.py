"""UDP sender: receivers that listen, end, return or do not exist; no blocking."""

import logging
import socket

import pytest

from zenocap.services.animator.outputs.output import QUIET_DATAGRAMS, DatagramSender, OutputError


def receiver(port: int = 0) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listening.bind(("127.0.0.1", port))
    listening.settimeout(2.0)
    return listening


def test_datagrams_arrive() -> None:
    with receiver() as listening:
        to = DatagramSender("animator.udp", "localhost", listening.getsockname()[1])
        to.send(b"one")
        assert listening.recv(100) == b"one"
        assert to.counts == {"sent": 1}
        to.close()


def test_a_receiver_that_ended_is_logged_once_and_served_again_when_it_is_back(caplog: pytest.LogCaptureFixture) -> None:
    listening = receiver()
    port = listening.getsockname()[1]
    to = DatagramSender("animator.vmc", "127.0.0.1", port)
    to.send(b"before")
    listening.close()
    for _ in range(20):
        to.send(b"lost")
    with receiver(port) as listening:
        to.send(b"after")
        assert listening.recv(100) == b"after"
    assert to.counts["refused"] > 15
    assert [record.getMessage() for record in caplog.records] == [
        f"animator.vmc 127.0.0.1:{port}: no program listens at this address; sending continues"
    ]
    to.close()


def test_a_failure_after_many_successes_is_logged_again(caplog: pytest.LogCaptureFixture) -> None:
    with receiver() as listening:
        port = listening.getsockname()[1]
    to = DatagramSender("animator.vmc", "127.0.0.1", port)
    for _ in range(3):
        to.send(b"lost")
    with receiver(port) as listening:
        for _ in range(QUIET_DATAGRAMS + 1):
            to.send(b"before")
    for _ in range(3):
        to.send(b"lost")
    assert len(caplog.records) == 2
    to.close()


def test_datagrams_to_a_receiver_that_never_reads_are_sent_or_dropped() -> None:
    with receiver() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        to = DatagramSender("animator.udp", "127.0.0.1", listening.getsockname()[1])
        for _ in range(5000):
            to.send(b"x" * 1000)
        assert to.counts["sent"] + to.counts["dropped"] == 5000
        to.close()


def test_a_datagram_that_is_too_large_is_counted_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    to = DatagramSender("animator.udp", "127.0.0.1", 9)
    to.send(b"x" * 70_000)
    assert to.counts["failed"] == 1
    assert "cannot be sent to: Message too long" in caplog.text
    to.close()


def test_an_unknown_host_is_an_error_at_once() -> None:
    with pytest.raises(OutputError, match=r"animator\.vmc\.host = 'no\.such\.host\.invalid': the address cannot"):
        DatagramSender("animator.vmc", "no.such.host.invalid", 39539)
    with pytest.raises(OutputError, match=r"animator\.vmc\.host = '\.\.': the address cannot"):
        DatagramSender("animator.vmc", "..", 39539)


def test_broadcast_addresses_are_allowed(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    to = DatagramSender("animator.udp", "127.255.255.255", 39600)
    to.send(b"to all")
    assert to.counts["sent"] + to.counts["refused"] >= 1
    to.close()
