"""Assigned camera of a host: obeyed and refused queries, process, end, restart."""

import os
import stat
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec
import pytest

from tests.common.rig.test_hosted import STREAM, rig
from zenocap.common.messages import AssignReply
from zenocap.common.rig.hosted import assignment
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.camera.assigned import AssignedCamera
from zenocap.services.camera.parameters import VIEWER_LEASE_S
from zenocap.services.camera.saved import saved_rig

WAITING = "import sys; sys.stdin.read()"
FAILING = "import sys; print('first', file=sys.stderr); print('camera: \\x1b[31mno image', file=sys.stderr); sys.exit(1)"


class Host:
    """One camera of a host, with a stand-in for the viewer's process."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.clock, self.program = folder, ManualClock(10**18), WAITING
        self.filmed = False
        self.query = assignment(rig(folder), "0", 5)
        self.camera = self.new()

    def new(self) -> AssignedCamera:
        return AssignedCamera(
            STREAM, self.folder / "data" / "cam.json", self.command, self.clock, previews=False,
            is_filmed=lambda: self.filmed,
        )  # fmt: skip

    def command(self, file: Path) -> Sequence[str]:
        return [sys.executable, "-c", self.program, str(file)]

    def ask(self, what: str = "assign", **changes: object) -> AssignReply:
        return self.camera.answer(msgspec.structs.replace(self.query, what=what, **changes))

    def until(self, reached: Callable[[AssignReply], bool]) -> AssignReply:
        end_s = time.monotonic() + 60.0
        while not reached(reply := self.ask("state")):
            assert time.monotonic() < end_s, reply
            time.sleep(0.02)
        return reply


@pytest.fixture
def host(tmp_path: Path) -> Iterator[Host]:
    one = Host(tmp_path)
    yield one
    one.camera.close()


def test_a_viewer_is_run_until_it_is_released(host):
    assert host.ask("state").state == "free"
    reply = host.ask()
    assert (reply.state, reply.refused, reply.rig, reply.viewer) == ("running", "", "studio", "0")
    assert host.camera.used_by == "viewer 0 of rig studio"
    assert host.ask(captured_ns=7).restarts == 0  # again: nothing changes
    assert host.ask("release").state == "free"
    assert host.camera.used_by == ""
    assert not list(host.folder.rglob("*.json"))


def test_another_rig_and_another_viewer_are_refused_and_cannot_release(host):
    host.ask()
    for what in ("assign", "release"):
        reply = host.ask(what, rig="lab")
        assert reply.refused == "the camera is used by viewer 0 of rig studio: allowed when that rig has ended"
        assert reply.state == "running"
    other = msgspec.structs.replace(host.query.viewer, id="1")
    assert "allowed: one viewer for each camera" in host.ask(viewer=other).refused


def test_other_settings_of_the_same_viewer_replace_it(host):
    host.ask()
    reply = host.ask(viewer=msgspec.structs.replace(host.query.viewer, fps=10.0))
    assert (reply.state, reply.refused) == ("running", "")
    assert saved_rig(host.folder / "data" / "cam.json", Path())[0].viewers[0].fps == 10.0


def test_a_camera_that_is_filmed_and_a_wrong_assignment_are_refused(host):
    host.filmed = True
    assert host.ask().refused == "the camera is being filmed: allowed when the film has ended"
    host.filmed = False
    assert "additions rm" in host.ask(additions=["rm"]).refused
    assert host.ask("state").state == "free"


def test_a_viewer_that_fails_is_started_again_and_its_error_is_reported(host):
    host.program = FAILING
    assert host.ask().state == "running"
    reply = host.until(lambda reply: reply.state == "waiting")
    assert reply.failure == "camera: \\x1b[31mno image"
    host.clock.advance(600_000_000)
    assert host.until(lambda reply: reply.restarts == 1).refused == ""


def test_a_rig_that_is_gone_loses_its_viewer(host):
    host.ask()
    host.clock.advance(int(VIEWER_LEASE_S * 0.9e9))
    assert host.ask().state == "running"
    host.clock.advance(int(VIEWER_LEASE_S * 0.9e9))
    assert host.ask("state").state == "running"
    host.clock.advance(int(VIEWER_LEASE_S * 0.2e9))
    assert host.ask("state", rig="lab").state == "free"  # a question is no assignment


def test_a_host_that_is_started_again_goes_on(host):
    host.ask()
    host.camera.close()
    file = host.folder / "data" / "cam.json"
    assert stat.S_IMODE(os.stat(file.parent).st_mode) == 0o700  # the source may have a password
    host.camera = host.new()
    assert host.ask("state").state == "running"
    assert saved_rig(file, Path())[0].viewers[0].source == STREAM
    host.clock.advance(int(VIEWER_LEASE_S * 1.1e9))
    assert host.ask("state").state == "free"


def test_a_damaged_assignment_is_left_alone(host, caplog):
    file = host.folder / "data" / "cam.json"
    file.parent.mkdir()
    file.write_text('{"query": 3}')
    host.camera = host.new()
    assert host.ask("state").state == "free"
    assert "no assignment of this version" in caplog.text
    assert host.ask().state == "running"


def test_no_word_of_an_assignment_reaches_the_command(host):
    commands: list[Path] = []
    host.command = lambda file: commands.append(file) or [sys.executable, "-c", WAITING]
    host.camera = host.new()
    host.ask(rig="..", viewer=msgspec.structs.replace(host.query.viewer, id="..", camera="x"))
    assert commands == [host.folder / "data" / "cam.json"]
    assert [path.name for path in host.folder.rglob("*.json")] == ["cam.json"]
