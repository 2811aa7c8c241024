"""Every evaluation runs in its shortest form, and every documented or listed one has such a form."""

import re

import pytest

from benchmarks.short_runs import ARGUMENTS, run
from tests.support.browser import CHROMIUM
from tests.support.places import ROOT

PAGES = (ROOT / "README.md", *(ROOT / "docs").glob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md")
# Chromium; OpenSim and a checkout of Pose2Sim; the wheel of anny
NEEDS_MORE = {"long_show", "page_pictures", "opensim_markers", "second_family"}
TESTED_ELSEWHERE = {"chaos", "faults"}  # tests/system/test_chaos.py, test_faults.py
NEEDS_CHROMIUM = {"page_speed"}


def runnable() -> set[str]:
    """Evaluations in benchmarks/: modules and packages that run as `python -m benchmarks.NAME`."""
    folder = ROOT / "benchmarks"
    modules = {path.stem for path in folder.glob("*.py") if '__name__ == "__main__"' in path.read_text(encoding="utf-8")}
    return modules | {path.parent.name for path in folder.glob("*/__main__.py")}


def test_every_evaluation_has_a_short_form() -> None:
    assert runnable() - {"short_runs"} - NEEDS_MORE == set(ARGUMENTS)


def test_make_evaluate_runs_known_evaluations() -> None:
    (names,) = re.findall(r"^EVALUATIONS := (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(names.split()) <= set(ARGUMENTS)


def test_every_documented_evaluation_exists() -> None:
    text = "\n".join(path.read_text(encoding="utf-8") for path in PAGES)
    named = set(re.findall(r"python -m benchmarks\.(\w+)", text))
    assert named
    assert named - {"micro"} <= runnable()


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", sorted(set(ARGUMENTS) - TESTED_ELSEWHERE))
def test_an_evaluation_runs(name: str) -> None:
    if name in NEEDS_CHROMIUM and CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    done = run(name, seconds=580)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip()
