"""Every action against a real receiver: done, refused, too slow."""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest
from pythonosc.osc_message import OscMessage

from tests.support.command_receivers import dripping_server, free_tcp_port, http_receiver, program, udp_receiver
from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.rig.commands import HttpAction, OscAction, ProgramAction, UdpAction, ZenohAction
from zenocap.common.runtime.clock import RealClock
from zenocap.services.recognizer.actions import ActionFailed, ProgramRunner, put, request_http, send_osc, send_udp

LONG_S = 30.0  # of programs that are to be killed


def test_a_put_is_received_by_another_session() -> None:
    place = f"tcp/127.0.0.1:{free_tcp_port()}"
    received: list[tuple[str, bytes]] = []
    came = threading.Event()
    options = ZenohOptions("peer", listen=(place,), multicast_scouting=False)
    with open_session(options) as other:

        def keep(sample: object) -> None:
            received.append((str(sample.key_expr), sample.payload.to_bytes()))  # type: ignore[attr-defined]
            came.set()

        other.declare_subscriber("lab/**", keep)
        connecting = ZenohOptions("peer", connect=(place,), multicast_scouting=False)
        with ZenohBus.open(connecting, "studio", RealClock()) as bus:
            sent = Mock()
            end_s = time.monotonic() + 60.0
            while not came.wait(0.1):  # until the sessions have found each other
                assert time.monotonic() < end_s
                put(ZenohAction(key="lab/slides/next", payload="größer"), bus.put, sent)
            assert sent.call_count >= 1
            with pytest.raises(ValueError, match="zenocap/studio/request: allowed: a key that does not begin"):
                bus.put("zenocap/studio/request", b"")
    assert received[0] == ("lab/slides/next", "größer".encode())


def refused(key: str, payload: bytes) -> None:
    raise BusError(f"{key} cannot be published: session closed")


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (lambda sent: put(ZenohAction(key="a"), refused, sent), "a cannot be published: session closed"),
        (lambda sent: send_osc(OscAction(host="no-such-host.invalid", port=9000, address="/a"), sent), r"\w"),
        (lambda sent: request_http(HttpAction(url=f"http://127.0.0.1:{free_tcp_port()}/"), sent), "Connection refused"),
        (lambda sent: request_http(HttpAction(url="http://192.0.2.1/"), sent), "not an address of this machine"),
        (lambda sent: ProgramRunner().run(ProgramAction(program="/nowhere/at/all"), {}, sent), "No such file"),
    ],
)
def test_what_cannot_begin_fails_before_anything_is_sent(act: Callable[[Mock], None], reason: str) -> None:
    """The other host even where the rig was not checked."""
    sent = Mock()
    with pytest.raises(ActionFailed, match=reason):
        act(sent)
    assert sent.call_count == 0


def test_an_osc_message_arrives_with_its_arguments() -> None:
    with udp_receiver() as receiver:
        sent = Mock()
        send_osc(OscAction(port=receiver.getsockname()[1], address="/slides/next", arguments=(1, 0.5, "left")), sent)
        message = OscMessage(receiver.recv(1500))
    assert (message.address, message.params, sent.call_count) == ("/slides/next", [1, 0.5, "left"], 1)


def test_a_udp_datagram_arrives_with_its_payload() -> None:
    with udp_receiver() as receiver:
        sent = Mock()
        send_udp(UdpAction(port=receiver.getsockname()[1], payload="größer"), sent)
        assert receiver.recv(1500) == "größer".encode()
    assert sent.call_count == 1


@pytest.mark.slow
def test_http_requests_arrive_with_method_path_and_body() -> None:
    with http_receiver() as receiver:
        sent = Mock()
        request_http(HttpAction(url=f"{receiver.url}/next?by=arm"), sent)
        request_http(HttpAction(url=receiver.url, method="POST", body="größer"), sent)
        assert receiver.requests == [("GET", "/next?by=arm", ""), ("POST", "/", "größer")]
        assert sent.call_count == 2


@pytest.mark.slow
@pytest.mark.parametrize("status", [302, 404, 500])
def test_other_status_codes_fail_and_redirections_are_not_followed(status: int) -> None:
    with http_receiver() as receiver:
        receiver.status = status
        with pytest.raises(ActionFailed, match=f"HTTP status {status}"):
            request_http(HttpAction(url=receiver.url), Mock())
        assert len(receiver.requests) == 1


@pytest.mark.slow
def test_a_server_that_does_not_reply_fails_after_the_timeout() -> None:
    with http_receiver() as receiver:
        receiver.status = None
        with pytest.raises(ActionFailed, match="timed out"):
            request_http(HttpAction(url=receiver.url, timeout=0.2), Mock())


@pytest.mark.slow
def test_a_server_that_replies_in_single_bytes_fails_after_the_timeout() -> None:
    with dripping_server() as place, pytest.raises(ActionFailed, match="timed out"):
        request_http(HttpAction(url=f"http://{place}", timeout=0.3), Mock())


def test_a_proxy_of_the_environment_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("http_proxy", f"http://127.0.0.1:{free_tcp_port()}")
    with http_receiver() as receiver:
        request_http(HttpAction(url=receiver.url), Mock())
        assert len(receiver.requests) == 1


def test_a_program_gets_arguments_as_written_and_the_posture_beside_the_recognizers_environment(tmp_path: Path) -> None:
    """Arguments are passed without a shell."""
    text = 'printf "%s|" "$#" "$1" "$ZENOCAP_POSTURE" "$ZENOCAP_CONFIDENCE" "$PATH" > "$2"'
    action = ProgramAction(program=program(tmp_path, "write", text), arguments=("$(id); a b", str(tmp_path / "out")))
    sent = Mock()
    ProgramRunner().run(action, {"ZENOCAP_POSTURE": "squat", "ZENOCAP_CONFIDENCE": "0.7"}, sent)
    assert (tmp_path / "out").read_text() == f"2|$(id); a b|squat|0.7|{os.environ['PATH']}|"
    assert sent.call_count == 1


def test_a_failing_program_gives_its_status_and_the_end_of_its_errors(tmp_path: Path) -> None:
    action = ProgramAction(program=program(tmp_path, "fail", "yes x | head -n 9999 >&2; echo no light >&2; exit 3"))
    with pytest.raises(ActionFailed, match=r"^exit status 3: x x .* no light$") as caught:
        ProgramRunner().run(action, {}, Mock())
    assert len(str(caught.value)) < 500


@pytest.mark.slow
def test_a_slow_program_is_killed_with_its_children(tmp_path: Path) -> None:
    script = f'sleep {LONG_S:g} & echo $! > "$1"; wait'
    action = ProgramAction(program=program(tmp_path, "slow", script), arguments=(str(tmp_path / "child"),), timeout=0.5)
    with pytest.raises(ActionFailed, match=r"killed after 0\.5 s"):
        ProgramRunner().run(action, {}, Mock())
    assert has_ended(int((tmp_path / "child").read_text()))


def test_stopping_kills_the_running_program_and_refuses_further_ones(tmp_path: Path) -> None:
    action = ProgramAction(program=program(tmp_path, "slow", f"exec sleep {LONG_S:g}"), timeout=LONG_S)
    runner, started, failures = ProgramRunner(), threading.Event(), []

    def run() -> None:
        try:
            runner.run(action, {}, started.set)
        except ActionFailed as failure:
            failures.append(str(failure))

    thread = threading.Thread(target=run)
    thread.start()
    assert started.wait(60)
    runner.stop()
    thread.join(60)
    assert failures == ["exit status -9"]
    with pytest.raises(ActionFailed, match="the recognizer is stopping"):
        runner.run(action, {}, Mock())


def has_ended(process: int) -> bool:
    """Whether a process ends within 10 s; a zombie counts as ended."""
    end_s = time.monotonic() + 60
    while time.monotonic() < end_s:
        try:
            state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state == "Z":
            return True
        os.sched_yield()
    return False
