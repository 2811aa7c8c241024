"""Summary of `up`: messages in the takes and lost ones."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from tests.common.recording.test_writer import record_take
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import HEALTH
from zenocap.tools.launcher.child_processes import ChildProcess, ChildProcesses
from zenocap.tools.launcher.shell import DONE, FAILED, LOSS, Supervisor

SERVICES = [("viewer", "1"), ("integrator", "main")]


def health(service: str, id: str, **counts: int) -> m.Health:
    return m.Health(frame=0, captured_ns=0, service=service, id=id, state="", rate=0.0, stages_ms={}, counts=counts)


def summary(take: Path | None, status: int | None, *healths: m.Health) -> tuple[int, str]:
    """Exit status and text after the children have ended.  status: exit status of the integrator."""
    bus = LocalNetwork("studio", ManualClock(1)).bus()
    children = ChildProcesses([], lambda: 0.0)
    children.all += [ChildProcess("viewer 1", (), status=0), ChildProcess("integrator", (), status=status)]
    console = Console(file=io.StringIO(), width=200)
    supervisor = Supervisor(children, bus, SERVICES, take, console)
    for one in healths:
        bus.publish(HEALTH, one)
    supervisor.receive_rest()
    result = supervisor.summary()
    assert isinstance(console.file, io.StringIO)
    return result, console.file.getvalue()


@pytest.fixture
def take(tmp_path: Path) -> Path:
    record_take(tmp_path / "take.mcap", 90).close()
    return tmp_path / "take.mcap"


def test_the_last_health_of_the_integrator_says_what_is_lost(take: Path) -> None:
    status, text = summary(
        take, LOSS, health("integrator", "main", log_lost=0), health("integrator", "main", log_lost=85_509, log_closed=1)
    )
    assert f"take: {take}: 180 messages, 85509 lost" in text
    assert status == LOSS


def test_without_a_last_health_nothing_is_said_to_be_complete(take: Path) -> None:
    status, text = summary(take, LOSS, health("integrator", "main", log_lost=0))
    assert "180 messages, an unknown number lost: see the integrator's output" in text
    assert status == LOSS
    assert " 0 lost" not in summary(take, -9)[1]
    assert summary(take, DONE) == (DONE, summary(take, DONE)[1])
    assert "180 messages, 0 lost" in summary(take, DONE)[1]


def test_other_services_cannot_say_what_is_lost(take: Path) -> None:
    status, text = summary(
        take, DONE, health("viewer", "9", log_lost=7, log_stopped=1), health("integrator", "main", log_lost=0, log_closed=1)
    )
    assert "180 messages, 0 lost" in text
    assert status == DONE


def test_a_cut_take_has_the_messages_that_can_be_read(take: Path) -> None:
    content = take.read_bytes()
    take.write_bytes(content[: int(0.7 * len(content))])
    status, text = summary(take, LOSS, health("integrator", "main", log_lost=60, log_closed=1, log_stopped=1))
    assert "take.mcap: 0 messages" not in text
    assert "messages, 60 lost" in text
    assert status == LOSS


def test_the_loss_of_several_takes_is_said_once(take: Path) -> None:
    record_take(take.with_name("take-2.mcap"), 30).close()
    text = summary(take, LOSS, health("integrator", "main", log_lost=3, log_closed=1))[1]
    assert "take.mcap: 180 messages\n" in text
    assert "take-2.mcap: 60 messages\n" in text
    assert text.count("3 lost") == 1


def test_a_failed_service_is_a_failure(take: Path) -> None:
    assert summary(take, 1)[0] == FAILED
    assert summary(None, DONE)[0] == DONE
