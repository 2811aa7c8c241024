"""`zenocap health`: success for a working service, failure for a frozen or missing one."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.support.command import app
from tests.support.demo_rigs import written_demo
from tests.support.networks import client, free_endpoint, router
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.runtime.clock import RealClock

pytestmark = pytest.mark.nightly
RIG = "healthtest"
LONGEST_S = 60.0  # that the command takes


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Endpoint of a router."""
    endpoint = free_endpoint()
    with router(endpoint):
        yield endpoint


def health_command(folder: Path, endpoint: str, *arguments: str, within_s: float = 2.0) -> Result:
    zenoh = f'[zenoh]\nmode = "client"\nconnect = ["{endpoint}"]\nmulticast_scouting = false\n'
    path = written_demo(folder, zenoh, name=RIG)
    return CliRunner().invoke(app, ["health", str(path), *arguments, "--within", f"{within_s:g}"])


def test_router_that_accepts_a_connection_is_healthy(tmp_path: Path, endpoint: str) -> None:
    assert health_command(tmp_path, endpoint, "router", within_s=LONGEST_S).exit_code == 0
    result = health_command(tmp_path, free_endpoint(), "router")
    assert result.exit_code == 1
    assert "stopped while waiting for a Zenoh router" in result.output


def test_service_that_handles_messages_is_healthy(tmp_path: Path, endpoint: str) -> None:
    stop = threading.Event()
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as bus:
        bus.declare_alive("viewer", "1")
        unanswered = health_command(tmp_path, endpoint, "viewer", "--id", "1")
        assert unanswered.exit_code == 1
        assert "viewer 1 of rig healthtest does not answer within 2 s" in unanswered.output

        def receive_messages() -> None:
            while not stop.is_set():
                bus.receive(0.05)

        worker = threading.Thread(target=receive_messages)
        worker.start()
        try:
            answered = health_command(tmp_path, endpoint, "viewer", "--id", "1", within_s=LONGEST_S)
            assert answered.exit_code == 0, answered.output
            assert health_command(tmp_path, endpoint, "viewer", "--id", "2").exit_code == 1
            assert health_command(tmp_path, endpoint, "integrator").exit_code == 1
        finally:
            stop.set()
            worker.join()


def test_unknown_service_is_wrong_usage(tmp_path: Path, endpoint: str) -> None:
    assert health_command(tmp_path, endpoint, "printer").exit_code == 2
