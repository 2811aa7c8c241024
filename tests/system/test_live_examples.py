"""The live examples receive poses of a running rig."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import zenocap
from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S
from tests.support.session_rigs import SessionRig
from zenocap.common.rig.rig import demo_rig_file

pytestmark = pytest.mark.nightly


@pytest.fixture
def endpoint(two_view_rig: SessionRig) -> str:
    """Where other programs connect to a running demo rig."""
    return two_view_rig.endpoint


def example(number: str, *arguments: str) -> subprocess.Popen[str]:
    (path,) = (ROOT / "examples").glob(f"{number}_*.py")
    return subprocess.Popen([sys.executable, path, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("number", ["06", "07"])
def test_poses_are_printed(number: str, endpoint: str) -> None:
    process = example(number, str(demo_rig_file("two-view")), endpoint)
    out, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    assert sum(line.startswith("frame ") for line in out.splitlines()) >= 20


def test_another_task_runs_beside_the_poses(endpoint: str) -> None:
    out, _ = example("07", str(demo_rig_file("two-view")), endpoint).communicate(timeout=PATIENCE_S)
    assert out.splitlines()[-1] == "20 poses; another task ran"


def test_datagrams_reach_another_program(endpoint: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(PATIENCE_S)
        port = receiver.getsockname()[1]
        process = example("10", str(demo_rig_file("two-view")), f"127.0.0.1:{port}", endpoint)
        try:
            hands = json.loads(receiver.recv(4096))
        finally:
            process.terminate()
            process.wait(PATIENCE_S)
    assert hands.keys() == {"frame", "right", "left"}
    assert 0.0 < hands["right"][1] < 2.5


def test_a_rig_is_found_by_its_name_or_the_wait_ends() -> None:
    """No rig of this name is running: iteration ends after the given time."""
    with zenocap.subscribe("no-such-rig", connect=["tcp/127.0.0.1:9"], timeout_s=0.5) as poses:
        assert list(poses) == []


def test_a_wrong_endpoint_is_a_user_error() -> None:
    with pytest.raises(zenocap.UserError, match="PROTOCOL/ADDRESS expected"):
        zenocap.subscribe("demo", connect=["nonsense"])


def test_a_rig_file_that_is_missing_is_a_user_error(tmp_path: Path) -> None:
    with pytest.raises(zenocap.UserError, match="no such rig"):
        zenocap.subscribe(tmp_path / "none.toml")
