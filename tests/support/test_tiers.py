"""Tiers: which one a test belongs to, files that stay together, and the limit of tests without a mark."""

import json
from pathlib import Path

import pytest

from tests.support.places import ROOT
from tests.support.tiers import group_of

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
        pytester.makeini("[pytest]\nmarkers =\n    slow\n    core\n    nightly\n")
        return pytester.runpytest_inprocess("-p", "tests.support.tiers", "-p", "no:cacheprovider", *options)

    return _run


@pytest.mark.nightly
def test_a_test_without_a_mark_fails_above_the_limit(run) -> None:
    source = "def test_quick(): pass\ndef test_busy(): spend(0.2)\n@pytest.mark.slow\ndef test_marked(): spend(0.2)\n"
    found = run(source, "--unit-limit", "0.1")
    found.assert_outcomes(passed=2, failed=1)
    found.stdout.fnmatch_lines(["*test_busy: 0.? s of processor time; allowed without a mark: 0.1 s*"])
    run(source, "--unit-limit", "0").assert_outcomes(passed=3)


@pytest.mark.nightly
def test_the_time_of_fixtures_counts_and_waiting_does_not(run) -> None:
    source = (
        "@pytest.fixture\ndef costly(): spend(0.2)\n"
        "def test_costly(costly): pass\ndef test_waiting(): time.sleep(0.2)\n"
    )  # fmt: skip
    run(source, "--unit-limit", "0.1").assert_outcomes(passed=1, failed=1)


@pytest.mark.slow
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


@pytest.mark.nightly
def test_groups_with_slow_tests_begin_first_and_stay_together(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makeini("[pytest]\nmarkers =\n    slow\n")
    for name, marked in (("test_a", ""), ("test_b", "@pytest.mark.slow\n"), ("one/test_c", "")):
        path = pytester.path / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        body = "def test_{0}(worker_id): open('{1}/{0}-' + worker_id, 'w')\n".replace("{1}", str(pytester.path))
        path.write_text("import pytest\n" + "".join(marked + body.format(f"{path.stem}_{k}") for k in range(3)))
    options = ["-p", "tests.support.tiers", "-p", "no:cacheprovider", "--import-mode=importlib"]
    listed = pytester.runpytest_inprocess(*options, "--collect-only", "-q").outlines
    assert listed[0].startswith("test_b.py")
    pytester.runpytest_subprocess(*options, "-n", "3", "--dist", "loadfile").assert_outcomes(passed=9)
    for group in ("test_a", "test_b", "test_c"):
        assert len({path.name.rpartition("-")[2] for path in pytester.path.glob(f"{group}_*-gw*")}) == 1


@pytest.mark.parametrize(
    ("file", "group"),
    [
        ("tests/common/body/test_rotations.py", "tests/common/body/test_rotations.py"),
        ("tests/system/test_zenoh_bus.py", "tests/system/test_zenoh_bus.py"),
        ("tests/system/browser/test_page.py", "tests/system/browser"),
        ("tests/system/test_two_view.py", "two_view"),
        ("tests/system/test_animator.py", "two_view"),
    ],
)
def test_a_group_is_a_file_or_what_shares_a_folder_or_a_rig_of_the_system_tests(file: str, group: str) -> None:
    assert (ROOT / file).is_file()
    assert group_of(file) == group
