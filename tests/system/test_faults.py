"""A cut link and a killed integrator in network namespaces: the short form of benchmarks.faults."""

from pathlib import Path

import pytest

from benchmarks.faults.network import problem
from benchmarks.faults.report import as_json, as_markdown, as_text, rows
from benchmarks.faults.run import run
from benchmarks.faults.scenarios import FAULTS

pytestmark = pytest.mark.nightly  # how soon a rig recovers, which other load changes
RECOVERED_S = 10.0  # on a busy machine (s); measured on a quiet one: about 1
PROCESS_S = 60.0  # start of a process (s)


def test_fault_names_are_unique() -> None:
    names = [fault.name for fault in FAULTS]
    assert len(set(names)) == len(names)
    assert {fault.method for fault in FAULTS if not fault.long} == {"two-view"}


def test_a_rig_survives_a_cut_link_and_a_killed_integrator(tmp_path: Path) -> None:
    reason = problem()
    if reason is not None:
        pytest.skip(reason)
    outcome = run([fault for fault in FAULTS if not fault.long], tmp_path, print)
    text = as_text(outcome) + as_markdown(outcome) + as_json(outcome)
    assert [row[0] for row in rows(outcome.results)] == [fault.name for fault in FAULTS if not fault.long]
    cut, killed = (result.figures for result in outcome.results)
    assert cut is not None, text
    assert killed is not None, text
    assert cut.recovered_s is not None, text
    assert cut.recovered_s < RECOVERED_S, text
    assert cut.poses > 0.5, text  # the other viewer's part continued
    assert cut.whole < 0.05, text  # and marked the missing one; one pose may have been in transit when the link was cut
    assert "1" not in cut.lost or cut.lost["1"] < 20, text
    assert killed.recovered_s is not None, text
    assert killed.recovered_s < PROCESS_S, text
    assert outcome.logs, text
    assert outcome.passed, text
    assert all(log.equal for log in outcome.logs), text
