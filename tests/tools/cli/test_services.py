"""Commands of services: takes of the integrator, model of the recognizer, port of the demo."""

import socket
from pathlib import Path
from unittest.mock import MagicMock, Mock

import pytest
import typer

from tests.common.rig.test_hosted import rig
from tests.support.command import refused
from tests.support.mjpeg_server import MjpegServer
from tests.support.networks import free_endpoint, listens
from tests.support.processes import ended, output_of, started, wait_until
from zenocap.common.rig.hosted import assignment
from zenocap.common.rig.rig import demo_rig, demo_rig_file
from zenocap.services.camera.saved import SavedAssignment, write_saved
from zenocap.tools.cli import services, up
from zenocap.tools.cli.services import with_recognizer
from zenocap.tools.record.launcher.shell import log_arguments


@pytest.mark.parametrize("model", [None, "fifteen"])
def test_the_commands_of_a_rig_are_kept_unless_they_are_switched_off(model: str | None) -> None:
    rig = demo_rig("two-view")
    kept, without = (with_recognizer(rig, model, commands=commands).recognizer for commands in (True, False))
    assert kept == rig.recognizer
    assert without is not None
    assert without.commands == ()
    assert {one.posture: one.action.target for one in kept.commands} == {
        "raise-right-arm": "demo/slides/next",
        "raise-left-arm": "demo/slides/previous",
        "raise-both-arms": "demo/slides/first",
    }


def test_the_demo_takes_a_free_port_where_the_usual_one_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[up.RunArguments] = []
    monkeypatch.setattr(up, "_run", lambda _, arguments, __: given.append(arguments))
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        monkeypatch.setattr(up, "DEMO_PORT", other.getsockname()[1])
        up.demo(given=up.RunArguments())
        up.demo(given=up.RunArguments(port=8090))
    assert [one.port for one in given] == [0, 8090]


@pytest.mark.parametrize(("output", "recordings", "folder"), [(None, "given", "given"), ("own/a.mcap", None, "own")])
def test_takes_of_the_page_go_into_the_folder_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str | None, recordings: str | None, folder: str
) -> None:
    """Without a first take they went into the folder of the rig file, which for the demo is in the package."""
    run = Mock(return_value=0)
    monkeypatch.setattr("zenocap.services.integrator.shell.run_integrator", run)
    take, given = (None if name is None else tmp_path / name for name in (output, recordings))
    with pytest.raises(typer.Exit):
        services.integrator(demo_rig_file(), take, take is None, given, arguments=MagicMock(with_parent=True))
    assert run.call_args.args[2:4] == (tmp_path / folder, take)
    assert log_arguments(tmp_path, None) == ["--recordings", str(tmp_path), "--no-log"]


@pytest.mark.slow
def test_an_assignment_has_no_working_size_above_the_cameras_own(tmp_path: Path) -> None:
    """One of 6680 x 5010 px took gigabytes where the camera gives 640 x 480."""
    file, query = tmp_path / "cam.json", assignment(rig(tmp_path), "0", 5)
    with MjpegServer((320, 240), 30.0) as camera:
        write_saved(file, SavedAssignment(query=query, source=camera.url, previews=False))
        error = refused("viewer", "--assigned", file, "--mode", "client", "--connect", "tcp/127.0.0.1:1")
    assert "size = [640, 480]: allowed: at most that of the camera's own images, 320 x 240 px" in error


@pytest.mark.core
def test_an_assigned_viewer_opens_its_camera_once(tmp_path: Path) -> None:
    """It looked at one image, and then opened the camera again."""
    file, query = tmp_path / "cam.json", assignment(rig(tmp_path), "0", 5)
    with MjpegServer((640, 480), 30.0) as camera:
        write_saved(file, SavedAssignment(query=query, source=camera.url, previews=False))
        network = ("-l", free_endpoint(), "--no-multicast-scouting")
        with started(["viewer", "--assigned", file, *network], tmp_path) as viewer:
            wait_until(lambda: listens(network[1]) and camera.sent > 40, tmp_path)
            assert ended(viewer) == 0, output_of(tmp_path)
        assert camera.opened == 1, output_of(tmp_path)
