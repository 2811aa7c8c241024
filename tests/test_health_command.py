"""`zenocap health`: a service that works answers, one that hangs or is not there does not."""

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from test_zenoh_bus import client, free_endpoint
from typer.testing import CliRunner, Result

from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions, open_session
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig_file
from services.cli import app

pytestmark = pytest.mark.system
RIG = "healthtest"


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Of a router."""
    endpoint = free_endpoint()
    with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
        yield endpoint


def asked(folder: Path, endpoint: str, *arguments: str) -> Result:
    source = demo_rig_file()
    shutil.copy(source.with_name("demo-calibration.toml"), folder)
    zenoh = f'[zenoh]\nmode = "client"\nconnect = ["{endpoint}"]\nmulticast_scouting = false\n'
    text = source.read_text().replace('name = "demo"', f'name = "{RIG}"', 1)
    path = folder / "rig.toml"
    path.write_text(text + zenoh)
    return CliRunner().invoke(app, ["health", str(path), *arguments, "--within", "2"])


def test_a_router_is_well_when_it_lets_one_in(tmp_path: Path, endpoint: str) -> None:
    assert asked(tmp_path, endpoint, "router").exit_code == 0
    result = asked(tmp_path, free_endpoint(), "router")
    assert result.exit_code == 1
    assert "stopped while waiting for a Zenoh router" in result.output


def test_a_service_that_handles_what_comes_is_well(tmp_path: Path, endpoint: str) -> None:
    done = threading.Event()
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as bus:
        bus.declare_alive("viewer", "1")
        hung = asked(tmp_path, endpoint, "viewer", "--id", "1")
        assert hung.exit_code == 1
        assert "viewer 1 of rig healthtest does not answer within 2 s" in hung.output

        def work() -> None:
            while not done.is_set():
                bus.receive(0.05)

        worker = threading.Thread(target=work)
        worker.start()
        try:
            assert asked(tmp_path, endpoint, "viewer", "--id", "1").exit_code == 0
            assert asked(tmp_path, endpoint, "viewer", "--id", "2").exit_code == 1
            assert asked(tmp_path, endpoint, "integrator").exit_code == 1
        finally:
            done.set()
            worker.join()


def test_another_service_is_wrong_usage(tmp_path: Path, endpoint: str) -> None:
    assert asked(tmp_path, endpoint, "printer").exit_code == 2
