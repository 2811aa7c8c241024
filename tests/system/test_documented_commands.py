"""Documented `zenocap` commands, run in a folder that has the files they name.

In the core tier one line of a command, in nightly all; tests/test_readme.py parses all.
Commands on files run to their end.  Services and other commands that run until Ctrl-C are stopped after a few seconds: they
must start, accept their options and end in order; their messages are tested elsewhere.
"""

import re
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from tests.support.documentation import command_of, distinct_commands, words_of
from tests.support.documented_folder import documented_folder, zenocap
from zenocap.common.bus.zenoh_session import free_ports

pytestmark = pytest.mark.timeout(600)
DONE, FAILED, LOSS, UNUSABLE, INTERRUPTED = 0, 1, 3, 4, 130
# Commands that run until Ctrl-C, and long ones: stopped.
LIVE = {
    "animator", "integrator", "load", "metrics", "posture act", "recognizer", "record", "replay", "router", "show", "top",
    "traces", "tracker", "up", "viewer",
}  # fmt: skip
# Commands whose result depends on the environment: the network, cameras, enough examples, answers.
MAY_FAIL = {
    "cameras", "doctor", "film", "health", "models add", "posture add", "posture evaluate", "posture train", "setup",
}  # fmt: skip
MAY_LOSE = {"calibrate board", "calibrate drift", "calibrate walk", "certs", "sync", "mirror", "setup", "track"}
UNCERTAIN = {name: {LOSS} for name in MAY_LOSE} | {"track": {LOSS, UNUSABLE}}
# Two views at 15 frames/s may show too little; no router runs.
STAND_INS = {
    "192.168.1.10": "127.0.0.1", "192.168.1.5": "127.0.0.1", "/etc/zenocap/rig.toml": "machines.toml",
    "RIG": "studio.toml", "SERVICE": "integrator", "NAME": "integrator",
}  # fmt: skip
# Commands of which no line runs in the core tier: other core tests start them, or they work on films or over minutes.
STARTED_ELSEWHERE = {"animator", "integrator", "recognizer", "replay", "router", "tracker", "up", "viewer"}
LONG = {
    "calibrate board", "calibrate detect", "calibrate drift", "calibrate walk", "film", "load", "mirror", "models add",
    "models remove", "posture act", "prior train", "setup", "sync", "track", "verify",
}  # fmt: skip
COMMANDS = distinct_commands()


def core_lines() -> set[str]:
    """The shortest line of each other command, of those that neither print help nor take long."""
    lines = [line for line in COMMANDS if not re.search(r"--help|--measure|\.mp4", line)]
    shortest = {command_of(line)[1]: line for line in sorted(lines, key=lambda line: -len(words_of(line)))}
    return {line for name, line in shortest.items() if name not in STARTED_ELSEWHERE | LONG}


CORE = core_lines()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Callable[[bool], Path]:
    """Function that returns the folder, with films or without."""

    @cache
    def made(films: bool) -> Path:
        place = tmp_path_factory.mktemp("documented")
        documented_folder(place, films=films)
        return place

    return made


def arguments_of(line: str) -> list[str]:
    """Arguments of a documented line with this machine's addresses and free ports."""
    (port,) = free_ports(1)
    words = words_of(line)
    for old, new in STAND_INS.items():
        words = [new if word == old else word.replace(old, new) if "." in old else word for word in words]
    words = [re.sub(r"0\.0\.0\.0:\d+", f"127.0.0.1:{port}", word) for word in words]
    if command_of(line)[1] in ("animator", "show"):
        words += ["--port", "0"]
    return words


def test_the_documentation_names_many_commands() -> None:
    assert len(COMMANDS) > 25


@pytest.mark.parametrize(
    "line", [pytest.param(line, marks=pytest.mark.core if line in CORE else pytest.mark.nightly) for line in COMMANDS]
)
def test_a_documented_command_runs(line: str, folder: Callable[[bool], Path]) -> None:
    name = command_of(line)[1]
    live = (name in LIVE and "--once" not in line) or "--live" in line
    live |= name == "posture label" and "--terminal" not in line and "--list" not in line
    status, output = zenocap(arguments_of(line), folder(line not in CORE), live=live)
    assert "Traceback" not in output, output
    ended = {DONE, FAILED, LOSS, INTERRUPTED, -signal.SIGTERM}
    allowed = ended if live else {DONE, FAILED} if name in (MAY_FAIL | LIVE) else {DONE}
    allowed |= UNCERTAIN.get(name, set())
    assert status in allowed, output
