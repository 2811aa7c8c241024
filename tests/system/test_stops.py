"""Stop of a rig one of whose services was started again: no service hangs, and the loss is said."""

from pathlib import Path

import pytest

from tests.measures.stops import stops
from zenocap.tools.record.launcher.shell import DONE, LOSS

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds processes in /proc"),
]


def test_no_service_is_killed_at_the_stop_of_a_rig(tmp_path: Path) -> None:
    found = list(stops(4, tmp_path, settled_s=0.0))
    assert [one.service for one in found] == ["viewer 1", "viewer 2", "viewer 3", "integrator"]
    assert [one.hung for one in found] == [0] * 4
    assert {one.status for one in found} <= {DONE, LOSS}
    assert found[-1].status == LOSS  # of the killed integrator
