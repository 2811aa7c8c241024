"""Datagrams to receivers that are there, gone, back, full or nowhere: sending never waits and never raises."""

import logging
import socket

import pytest

from services.animator.outputs.datagrams import QUIET_AFTER, Datagrams
from services.animator.outputs.output import OutputError


def receiver(port: int = 0) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listening.bind(("127.0.0.1", port))
    listening.settimeout(2.0)
    return listening


def test_what_is_sent_arrives() -> None:
    with receiver() as listening:
        to = Datagrams("animator.udp", "localhost", listening.getsockname()[1])
        to.send(b"one")
        assert listening.recv(100) == b"one"
        assert to.counts == {"sent": 1}
        to.close()


def test_a_receiver_that_is_gone_is_told_once_and_served_again_when_it_is_back(caplog: pytest.LogCaptureFixture) -> None:
    listening = receiver()
    port = listening.getsockname()[1]
    to = Datagrams("animator.vmc", "127.0.0.1", port)
    to.send(b"heard")
    listening.close()
    for _ in range(20):
        to.send(b"unheard")
    with receiver(port) as listening:
        to.send(b"heard again")
        assert listening.recv(100) == b"heard again"
    assert to.counts["unheard"] > 15
    assert [record.getMessage() for record in caplog.records] == [
        f"animator.vmc 127.0.0.1:{port}: nobody listens there; sending goes on"
    ]
    to.close()


def test_after_a_long_time_without_failure_a_new_one_is_worth_a_line_again(caplog: pytest.LogCaptureFixture) -> None:
    with receiver() as listening:
        port = listening.getsockname()[1]
    to = Datagrams("animator.vmc", "127.0.0.1", port)
    for _ in range(3):
        to.send(b"unheard")
    with receiver(port) as listening:
        for _ in range(QUIET_AFTER + 1):
            to.send(b"heard")
    for _ in range(3):
        to.send(b"unheard")
    assert len(caplog.records) == 2
    to.close()


def test_a_receiver_that_never_reads_costs_only_its_own_datagrams() -> None:
    with receiver() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        to = Datagrams("animator.udp", "127.0.0.1", listening.getsockname()[1])
        for _ in range(5000):
            to.send(b"x" * 1000)
        assert to.counts["sent"] + to.counts["dropped"] == 5000
        to.close()


def test_what_is_too_large_for_a_datagram_is_counted_and_told(caplog: pytest.LogCaptureFixture) -> None:
    to = Datagrams("animator.udp", "127.0.0.1", 9)
    to.send(b"x" * 70_000)
    assert to.counts["failed"] == 1
    assert "cannot be sent to: Message too long" in caplog.text
    to.close()


def test_a_name_that_nobody_knows_is_an_error_at_once() -> None:
    with pytest.raises(OutputError, match=r"animator\.vmc\.host = 'no\.such\.host\.invalid': not an address"):
        Datagrams("animator.vmc", "no.such.host.invalid", 39539)
    with pytest.raises(OutputError, match=r"animator\.vmc\.host = '\.\.': not an address"):
        Datagrams("animator.vmc", "..", 39539)


def test_broadcasting_is_allowed(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    to = Datagrams("animator.udp", "127.255.255.255", 39600)
    to.send(b"to all")
    assert to.counts["sent"] + to.counts["unheard"] >= 1
    to.close()
