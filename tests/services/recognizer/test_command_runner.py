"""Commands beside the service loop: latency, drops, failures, closing."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from unittest.mock import Mock

import pytest

from tests.support.command_receivers import SECOND, http_receiver, posture_at, program, udp_receiver
from tests.support.live_cameras import until
from zenocap.common.messages import CommandResult
from zenocap.common.rig.commands import posture_commands
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.clock_offset import Offset
from zenocap.services.recognizer.command_runner import CommandRunner
from zenocap.services.recognizer.parameters import COMMANDS_WAITING

PATIENCE_S = 60.0
NOW = 1_700_000_000 * SECOND
ZENOH: dict[str, object] = {"action": "zenoh", "key": "lab/squat", "payload": "1", "cooldown": 0}


class Puts:
    """Put of a bus: keeps keys and payloads; blocks while `held`."""

    def __init__(self) -> None:
        self.received: list[tuple[str, bytes]] = []
        self.open = threading.Event()
        self.open.set()

    def __call__(self, key: str, payload: bytes) -> None:
        assert self.open.wait(PATIENCE_S)
        self.received.append((key, payload))


@contextmanager
def running(
    tables: dict[str, object], puts: Callable[[str, bytes], None] | None = None, now_ns: int = NOW
) -> Iterator[CommandRunner]:
    """Runner of the tables of commands by posture, at a time; all programs are allowed."""
    programs = [table["program"] for table in tables.values() if isinstance(table, dict) and "program" in table]
    commands = posture_commands(tables, programs)
    with closing(CommandRunner("studio", commands, puts or Puts(), lambda: None, ManualClock(now_ns))) as runner:
        yield runner


def program_table(path: str, argument: Path, **fields: object) -> dict[str, object]:
    """Table of a command that runs a program."""
    return {"action": "program", "program": path, "arguments": [str(argument)]} | fields


def results_of(runner: CommandRunner, count: int) -> list[CommandResult]:
    """The next `count` results."""
    found: list[CommandResult] = []

    def complete() -> bool:
        found.extend(runner.results())
        return len(found) >= count

    until(complete)
    return found


def performed(runner: CommandRunner, captured_ns: int, times: int = 1) -> list[CommandResult]:
    """Results of a posture that is received so many times, of one command."""
    for _ in range(times):
        runner.receive(posture_at(captured_ns))
    return results_of(runner, times)


def test_a_posture_triggers_a_command_and_its_result_has_the_latency() -> None:
    tables, puts = {"squat": ZENOH, "kick": {"action": "zenoh", "key": "lab/kick"}}, Puts()
    with running(tables, puts, NOW + SECOND // 50) as runner:
        (result,) = performed(runner, NOW)
        runner.receive(posture_at(NOW, None))
        assert runner.counts()["commands_done"] == 1
    assert puts.received == [("lab/squat", b"1")]
    assert (result.frame, result.captured_ns, result.posture, result.action, result.target) == (
        0, NOW, "squat", "zenoh", "lab/squat",
    )  # fmt: skip
    assert (result.latency_ns, result.since_end_ns, result.since_start_ns) == (
        SECOND // 50, 32 * SECOND // 100, 232 * SECOND // 100,
    )  # fmt: skip
    assert (result.outcome, result.error) == ("done", "")
    assert 0.5 < result.confidence < 0.7


def test_a_datagram_has_what_is_known_of_the_posture() -> None:
    one = posture_at(NOW)
    with udp_receiver() as receiver:
        table = {"action": "udp", "port": receiver.getsockname()[1]}
        with running({"*": table}) as runner:
            (result,), said = performed(runner, NOW), json.loads(receiver.recv(1500))
    assert (result.posture, result.action, result.outcome) == ("squat", "udp", "done")
    numbers = {"begin": one.start_ns / 1e9, "end": one.end_ns / 1e9, "duration": (one.end_ns - one.start_ns) / 1e9}
    assert said == {name: pytest.approx(value, abs=1e-3) for name, value in numbers.items()} | {
        "rig": "studio", "posture": "squat", "confidence": pytest.approx(result.confidence, abs=6e-4), "count": 1,
    }  # fmt: skip


def test_a_payload_has_its_placeholders_replaced() -> None:
    puts, table = Puts(), ZENOH | {"payload": '{"next": {count}, "{posture}": true}'}
    with running({"squat": table}, puts) as runner:
        performed(runner, NOW, 2)
    assert puts.received == [("lab/squat", b'{"next": %d, "squat": true}' % count) for count in (1, 2)]


def test_capture_times_are_on_the_clock_of_the_integrator() -> None:
    """A clock that is 50 s ahead makes no posture old; without it a posture is as of a replayed take."""
    puts = Puts()
    with running({"squat": ZENOH}, puts, NOW + 50 * SECOND) as runner:
        runner.receive(posture_at(NOW))
        assert (runner.counts()["commands_old"], list(runner.results()), puts.received) == (1, [], [])
        runner.set_clock_offset(Offset(50 * SECOND - SECOND // 100, 1000))
        assert performed(runner, NOW)[0].latency_ns == SECOND // 100


def test_too_many_at_once_are_dropped_and_reported_without_waiting() -> None:
    puts = Puts()
    puts.open.clear()
    with running({"squat": ZENOH}, puts) as runner:
        offered = COMMANDS_WAITING + 5
        for _ in range(offered):
            runner.receive(posture_at(NOW))  # returns although the put blocks
        dropped = list(runner.results())
        puts.open.set()
        done = results_of(runner, offered - len(dropped))
        assert {result.outcome for result in dropped} == {"dropped"}
        assert {result.outcome for result in done} == {"done"}
        assert dropped[0].error == f"{COMMANDS_WAITING} earlier ones are waiting"
        assert COMMANDS_WAITING <= len(done) <= COMMANDS_WAITING + 1
        assert [result.frame for result in (*dropped, *done)] == list(range(offered))
        assert runner.counts()["commands_dropped"] == len(dropped)


@pytest.mark.slow
def test_a_slow_command_does_not_delay_another() -> None:
    with http_receiver() as receiver:
        receiver.status = None
        tables = {"squat": [{"action": "http", "url": receiver.url, "timeout": 10, "cooldown": 0}, ZENOH]}
        with running(tables) as runner:
            assert [result.action for result in performed(runner, NOW)] == ["zenoh"]
            receiver.status = 204
            receiver.released.set()
            (slow,) = results_of(runner, 1)
            assert (slow.action, slow.outcome) == ("http", "done")


def test_a_failing_command_is_reported_and_the_next_ones_are_performed(tmp_path: Path) -> None:
    path = program(tmp_path, "lights", 'test -e "$1" && exit 4; touch "$1"; echo broken >&2; exit 3')
    with running({"squat": program_table(path, tmp_path / "file", cooldown=0)}) as runner:
        first, second = performed(runner, NOW, 2)
        assert (first.outcome, first.error, second.error) == ("failed", "exit status 3: broken", "exit status 4")
        assert runner.counts()["commands_failed"] == 2


def test_an_unexpected_error_is_a_failure_and_ends_no_thread() -> None:
    broken = Mock(side_effect=RuntimeError("a bug"))
    with running({"squat": ZENOH}, broken) as runner:
        assert {result.error for result in performed(runner, NOW, 2)} == {"RuntimeError: a bug"}
    assert broken.call_count == 2


def test_a_program_gets_posture_confidence_and_rig(tmp_path: Path) -> None:
    path = program(tmp_path, "write", 'echo "$ZENOCAP_RIG $ZENOCAP_POSTURE $ZENOCAP_CONFIDENCE" > "$1"')
    with running({"squat": program_table(path, tmp_path / "out")}) as runner:
        (result,) = performed(runner, NOW)
    assert (tmp_path / "out").read_text() == f"studio squat {result.confidence:.3f}\n"


def test_closing_kills_a_running_program(tmp_path: Path) -> None:
    path = program(tmp_path, "slow", 'touch "$1"; exec sleep 60')
    with running({"squat": program_table(path, tmp_path / "begun", timeout=60)}) as runner:
        runner.receive(posture_at(NOW))
        until((tmp_path / "begun").exists)
    (result,) = runner.results()
    assert (result.outcome, result.error) == ("failed", "exit status -9")


def test_a_rig_without_commands_has_no_threads_and_no_counts() -> None:
    before = threading.active_count()
    with running({}) as runner:
        assert threading.active_count() == before
        assert runner.counts() == {}
