"""A minute of random faults against a whole rig: the kind `chaos` with one seed, and so one schedule."""

import itertools
from pathlib import Path

import pytest

from benchmarks.chaos.run import Run
from benchmarks.chaos.schedule import schedule

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds processes in /proc"),
]
SEED, SECONDS = 1, 60.0
RECOVERED_S = 20.0  # on a busy machine (s); 5 on a quiet one


@pytest.mark.timeout(600)
def test_a_rig_survives_a_minute_of_chaos(tmp_path: Path) -> None:
    outcome = Run(SEED, SECONDS, poses_s=RECOVERED_S).run(tmp_path)
    text = outcome.text()
    assert outcome.violations == [], text
    assert len(outcome.recoveries) >= 4, text
    assert [each.round for each in outcome.recoveries] == list(itertools.islice(schedule(SEED), len(outcome.recoveries)))
    assert outcome.takes, text
