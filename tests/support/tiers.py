"""Tiers of tests, as a pytest plugin: which tests run together, and the limit of tests without a mark.

A test belongs to the last tier of its marks: unit (no mark), slow, core, nightly.
"""

import gc
import json
import re
import resource
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path, PurePosixPath

import pytest
from hypothesis import given, settings
from hypothesis.strategies import from_regex
from numba.core import event
from xdist.scheduler import LoadScopeScheduling

from tests.support.places import ROOT

TIERS = ("unit", "slow", "core", "nightly")
UNIT_LIMIT_S = float(tomllib.loads((ROOT / "tests" / "budgets.toml").read_text())["seconds"]["test without a mark"])
SESSION_RIG = re.compile(r"\b(two_view|ring|secured)_(?:rig|take)\b")  # fixtures of tests/system


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("tiers")
    group.addoption(
        "--unit-limit", type=float, default=UNIT_LIMIT_S, metavar="SECONDS",
        help="processor time of a test without a mark, above which it fails; 0: no limit (default: %(default)s)",
    )  # fmt: skip
    group.addoption("--times", type=Path, metavar="FILE", help="write the time of each test as JSON")


def tier_of(item: pytest.Item) -> str:
    return next((tier for tier in reversed(TIERS) if item.get_closest_marker(tier)), TIERS[0])


def pytest_collection(session: pytest.Session) -> None:
    """Collect without the garbage collector.  Without bytecode, let each worker make another part of it first."""
    gc.disable()
    worker = getattr(session.config, "workerinput", None)
    if worker is not None and session.config.args == session.config.getini("testpaths"):
        files = sorted((ROOT / "tests").rglob("test_*.py"))
        begin = int(worker["workerid"].removeprefix("gw")) * len(files) // worker["workercount"]
        for file in files[begin:] if begin else ():
            with suppress(Exception, pytest.skip.Exception):  # the collection reports them
                import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let groups with slow tests begin first, so that no worker is left with one at the end."""
    heavy: dict[str, int] = {}
    for item in items:
        group = group_of(file_of(item.nodeid))
        heavy[group] = heavy.get(group, 0) + 10 ** TIERS.index(tier_of(item))
    items.sort(key=lambda item: -heavy[group_of(file_of(item.nodeid))])  # stable


def file_of(nodeid: str) -> str:
    return nodeid.split("::")[0]


@cache
def group_of(file: str) -> str:
    """What runs in one worker with a file, so that its fixtures are made once.

    In tests/system that is its folder, or the files that use the same session rig.  Marks xdist_group have no effect with
    pytest 9, whose node ids xdist cannot change.
    """
    path = PurePosixPath(file)
    if not path.is_relative_to("tests/system"):
        return file
    rigs = re.findall(SESSION_RIG, (ROOT / file).read_text(encoding="utf-8"))
    return rigs[0] if rigs else str(path.parent) if len(path.parts) > 3 else file


class Scheduling(LoadScopeScheduling):
    """xdist's distribution by groups, in the order of the collection."""

    def __init__(self, config: pytest.Config, log: object) -> None:
        config.option.loadscopereorder = False
        super().__init__(config, log)

    def _split_scope(self, nodeid: str) -> str:
        return group_of(file_of(nodeid))


def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Scheduling | None:
    return Scheduling(config, log) if config.getvalue("dist") == "loadfile" else None


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave what the collection has made, hundreds of thousands of objects, out of each later garbage collection.

    In a new clone the first text of hypothesis takes seconds, for a table of all characters: they are in no test.
    """
    if any(item.get_closest_marker("hypothesis") for item in session.items):
        given(from_regex("[a-z]"))(settings(max_examples=1, database=None)(lambda text: None))()
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_sessionfinish() -> None:
    """Write what coverage has counted: a worker is killed where its libraries do not let it end in time."""
    coverage = sys.modules.get("coverage")
    current = None if coverage is None else coverage.Coverage.current()
    if current is not None:
        current.save()


class Compiling(event.Listener):
    """Processor time spent in compiling kernels (s)."""

    def __init__(self) -> None:
        self.total_s = self._start_s = 0.0
        self._depth = 0

    def on_start(self, event: object) -> None:
        if self._depth == 0:
            self._start_s = time.process_time()
        self._depth += 1

    def on_end(self, event: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.total_s += time.process_time() - self._start_s


COMPILING = Compiling()
event.register("numba:compile", COMPILING)


def _used_s() -> float:
    """Processor time of this process and of its ended children, without what is made once and kept in the cache (s).

    Unlike time on the clock it does not depend on what else the machine does.
    """
    stored = sys.modules.get("tests.support.stored")
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    made_s = 0.0 if stored is None else stored.made_s
    return time.process_time() + children.ru_utime + children.ru_stime - COMPILING.total_s - made_s


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    item.stash[STARTED] = _used_s()
    item.stash[COMPILED] = COMPILING.total_s
    return (yield)


STARTED = pytest.StashKey[float]()
COMPILED = pytest.StashKey[float]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[pytest.TestReport]:
    report = yield
    if report.when != "call":
        return report
    used_s, tier = _used_s() - item.stash[STARTED], tier_of(item)
    compiling_s = COMPILING.total_s - item.stash[COMPILED]
    row = {"tier": tier, "processor_s": round(used_s, 3), "compiling_s": round(compiling_s, 3)}
    report.user_properties.append(("time", row))
    limit_s = item.config.getoption("--unit-limit")
    if tier == "unit" and 0 < limit_s < used_s and report.passed:
        report.outcome = "failed"
        report.longrepr = (
            f"{item.nodeid}: {used_s:.1f} s of processor time; allowed without a mark: {limit_s:g} s. "
            f"Make it quicker, or mark it with its tier: {', '.join(TIERS[1:])}."
        )
    return report


class Times:
    """Collects the reports of all workers and writes them at the end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, dict[str, object]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        row = self.rows.setdefault(report.nodeid, {"clock_s": 0.0})
        row["clock_s"] = round(float(str(row["clock_s"])) + report.duration, 3)
        row.update(*(value for name, value in report.user_properties if name == "time"))

    def pytest_sessionfinish(self) -> None:
        self.path.write_text(json.dumps(self.rows, indent=0) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--times")
    if path is not None and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Times(path.absolute()))
