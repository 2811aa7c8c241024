"""Stop of a rig, also one whose services were ended: no service hangs, and the loss is said."""

import signal
from pathlib import Path

import pytest

from benchmarks.chaos.schedule import INTEGRATOR, VIEWERS
from tests.measures.stops import stop_after
from tests.support.processes import children_of, ended, output_of, started, wait_until
from zenocap.tools.record.launcher.shell import DONE, INTERRUPTED, LOSS

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds processes in /proc"),
]


def test_no_service_hangs_at_the_stop_of_a_rig(tmp_path: Path) -> None:
    found = [stop_after(service, tmp_path / service, 0.0) for service in (*VIEWERS, INTEGRATOR)]
    assert [one.hung for one in found] == [0] * 4
    assert {one.status for one in found} <= {DONE, LOSS}
    assert found[-1].status == LOSS  # of the killed integrator


@pytest.mark.parametrize("service", ["tracker", "integrator"])
def test_a_service_that_another_program_ends_is_started_again(service: str, tmp_path: Path) -> None:
    """Such as a session manager, or what frees memory: it counted as finished, and the rig went on without it."""
    found = stop_after(service, tmp_path, 0.0, signal.SIGTERM)
    assert found.hung == 0
    assert found.status in (DONE, LOSS), found.text
    assert f"{service}: ended, although it was to run on (exit status " in found.text
    assert f"{service}: started again" in found.text
    assert "failed (exit status" not in found.text
    assert "failed; see its output above" not in found.text


def test_a_rig_that_is_interrupted_while_it_starts_has_not_failed(tmp_path: Path) -> None:
    """It said that the integrator had failed, with nothing about it above."""
    with started(["demo", "--port", "0"], tmp_path) as demo:
        wait_until(lambda: bool(children_of(demo.pid)), tmp_path, running=[demo])
        assert ended(demo, signal.SIGINT) == INTERRUPTED, output_of(tmp_path)
    assert "failed" not in output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)
