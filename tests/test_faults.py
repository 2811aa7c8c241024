"""A link cut and an integrator killed on real hosts, in network namespaces: the short form of tests.evaluation.faults."""

from pathlib import Path

import pytest

from tests.evaluation.faults.network import problem
from tests.evaluation.faults.report import as_json, as_markdown, as_text, rows
from tests.evaluation.faults.run import run
from tests.evaluation.faults.scenarios import FAULTS

pytestmark = pytest.mark.system
RECOVERED_S = 5.0  # on a machine that has other things to do; measured on a quiet one it is about a second
PROCESS_S = 15.0  # starting a process


def test_names_tell_the_faults_apart() -> None:
    names = [fault.name for fault in FAULTS]
    assert len(set(names)) == len(names)
    assert {fault.method for fault in FAULTS if not fault.long} == {"two-view"}


@pytest.mark.timeout(300)
def test_a_rig_survives_a_cut_link_and_a_killed_integrator(tmp_path: Path) -> None:
    why = problem()
    if why is not None:
        pytest.skip(why)
    outcome = run([fault for fault in FAULTS if not fault.long], tmp_path, print)
    text = as_text(outcome) + as_markdown(outcome) + as_json(outcome)
    assert [row[0] for row in rows(outcome.results)] == [fault.name for fault in FAULTS if not fault.long]
    cut, killed = (result.figures for result in outcome.results)
    assert cut is not None, text
    assert killed is not None, text
    assert cut.recovered_s is not None, text
    assert cut.recovered_s < RECOVERED_S, text
    assert cut.poses > 0.5, text  # the healthy part went on
    assert cut.whole < 0.05, text  # and said that it was without the other; one may have been under way when it was cut
    assert "1" not in cut.lost or cut.lost["1"] < 20, text
    assert killed.recovered_s is not None, text
    assert killed.recovered_s < PROCESS_S, text
    assert outcome.logs, text
    assert outcome.well, text
    assert all(log.equal for log in outcome.logs), text
