"""Assigned camera of a host: obeyed and refused queries, process, end, restart."""

import os
import stat
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from msgspec import structs

from tests.common.rig.test_hosted import STREAM, rig
from tests.support.live_cameras import until
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
        self.query, self.file = assignment(rig(folder), "0", 5), folder / "data" / "cam.json"
        self.restart()

    def restart(self) -> None:
        self.camera = AssignedCamera(
            STREAM, self.file, self.command, self.clock, previews=False, is_filmed=lambda: self.filmed
        )

    def command(self, file: Path) -> Sequence[str]:
        return [sys.executable, "-c", self.program, str(file)]

    def ask(self, what: str = "assign", **changes: object) -> AssignReply:
        return self.camera.answer(structs.replace(self.query, what=what, **changes))

    def until(self, reached: Callable[[AssignReply], bool]) -> AssignReply:
        until(lambda: reached(self.ask("state")), "a state of the camera")
        return self.ask("state")


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
    other = structs.replace(host.query.viewer, id="1")
    assert "allowed: one viewer for each camera" in host.ask(viewer=other).refused


def test_other_settings_of_the_same_viewer_replace_it(host):
    host.ask()
    reply = host.ask(viewer=structs.replace(host.query.viewer, fps=10.0))
    assert (reply.state, reply.refused) == ("running", "")
    assert saved_rig(host.file, Path())[0].viewers[0].fps == 10.0


def test_a_camera_that_is_filmed_and_a_wrong_assignment_are_refused(host):
    host.filmed = True
    assert host.ask().refused == "the camera is being filmed: allowed when the film has ended"
    host.filmed = False
    assert "additions rm" in host.ask(additions=["rm"]).refused
    assert host.ask("state").state == "free"


def test_a_viewer_that_fails_is_started_again_and_its_error_is_reported(host):
    host.program = FAILING
    assert host.ask().state == "running"
    assert host.until(lambda reply: reply.state == "waiting").failure == "camera: \\x1b[31mno image"
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
    assert stat.S_IMODE(os.stat(host.file.parent).st_mode) == 0o700  # the source may have a password
    host.restart()
    assert host.ask("state").state == "running"
    assert saved_rig(host.file, Path())[0].viewers[0].source == STREAM
    host.clock.advance(int(VIEWER_LEASE_S * 1.1e9))
    assert host.ask("state").state == "free"


def test_a_damaged_assignment_is_left_alone(host, caplog):
    host.file.parent.mkdir()
    host.file.write_text('{"query": 3}')
    host.restart()
    assert host.ask("state").state == "free"
    assert "no assignment of this version" in caplog.text
    assert host.ask().state == "running"


def test_no_word_of_an_assignment_reaches_the_command(host):
    commands: list[Path] = []
    host.command = lambda file: commands.append(file) or [sys.executable, "-c", WAITING]
    host.restart()
    host.ask(rig="..", viewer=structs.replace(host.query.viewer, id="..", camera="x"))
    assert commands == [host.file]
    assert [path.name for path in host.folder.rglob("*.json")] == ["cam.json"]
