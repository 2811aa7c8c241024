"""Tiers: which one a test belongs to, files that stay together, and the limit of tests without a mark."""

import json
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]
SPEND = """
import time
import pytest

def spend(seconds):
    end_s = time.process_time() + seconds
    while time.process_time() < end_s:
        pass
"""


@pytest.fixture
def run(pytester: pytest.Pytester):
    def _run(source: str, *options: str) -> pytest.RunResult:
        pytester.makepyfile(test_one=SPEND + source)
        pytester.makeini("[pytest]\nmarkers =\n    slow\n    core\n    nightly\n    xdist_group(name)\n")
        return pytester.runpytest_inprocess("-p", "tests.support.tiers", "-p", "no:cacheprovider", *options)

    return _run


def test_a_test_without_a_mark_fails_above_the_limit(run) -> None:
    source = "def test_quick(): pass\ndef test_busy(): spend(0.2)\n@pytest.mark.slow\ndef test_marked(): spend(0.2)\n"
    found = run(source, "--unit-limit", "0.1")
    found.assert_outcomes(passed=2, failed=1)
    found.stdout.fnmatch_lines(["*test_busy: 0.2 s of processor time; allowed without a mark: 0.1 s*"])
    run(source, "--unit-limit", "0").assert_outcomes(passed=3)


def test_the_time_of_fixtures_counts_and_waiting_does_not(run) -> None:
    source = (
        "@pytest.fixture\ndef costly(): spend(0.2)\n"
        "def test_costly(costly): pass\ndef test_waiting(): time.sleep(0.2)\n"
    )  # fmt: skip
    run(source, "--unit-limit", "0.1").assert_outcomes(passed=1, failed=1)


def test_times_and_tiers_are_written(run, tmp_path: Path) -> None:
    source = (
        "pytestmark = pytest.mark.core\ndef test_core(): pass\n@pytest.mark.nightly\ndef test_both(): pass\n"
        "@pytest.mark.slow\ndef test_slow_core(): spend(0.1)\n"
    )
    run(source, "--times", str(tmp_path / "times.json"))
    rows = json.loads((tmp_path / "times.json").read_text())
    tiers = {name.split("::")[1]: row["tier"] for name, row in rows.items()}
    assert tiers == {"test_core": "core", "test_both": "nightly", "test_slow_core": "core"}
    assert rows["test_one.py::test_slow_core"]["processor_s"] >= 0.1


def test_files_with_slow_tests_begin_first_and_files_stay_together(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nmarkers =\n    slow\n    xdist_group(name)\n")
    pytester.makepyfile(
        test_a="def test_1(): pass\ndef test_2(): pass\n",
        test_b="import pytest\ndef test_1(): pass\n@pytest.mark.slow\ndef test_2(): pass\n",
        test_c="import pytest\n@pytest.mark.xdist_group('other')\ndef test_1(): pass\n",
    )
    found = pytester.runpytest_inprocess("-p", "tests.support.tiers", "-p", "no:cacheprovider", "--collect-only", "-q")
    names = [line for line in found.outlines if "::" in line]
    assert names == [
        "test_b.py::test_1",
        "test_b.py::test_2",
        "test_a.py::test_1",
        "test_a.py::test_2",
        "test_c.py::test_1",
    ]
