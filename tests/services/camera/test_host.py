"""Announced cameras of a host, names that it refuses, and a second program that answers in its place."""

import threading
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import Mock

import pytest

from tests.support.live_cameras import until
from tests.support.networks import client, free_endpoint, listener
from zenocap.common import codec
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery, AssignReply, FilmQuery, FilmReply
from zenocap.common.rig.sources import Stream
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.video.v4l2.camera import Mode
from zenocap.common.video.v4l2.listing import FoundCamera
from zenocap.services.camera.endpoint import FilmEndpoint
from zenocap.services.camera.host_cameras import MOST_CAMERAS, named_camera
from zenocap.services.camera.shell import CameraHostServer, Viewers
from zenocap.tools.setup.cameras.hosts import host_data, host_lines


def camera(number: int, modes: int = 60) -> FoundCamera:
    all_modes = tuple(Mode("MJPG", (640 + k, 480), (30.0, 15.0)) for k in range(modes))
    source = f"/dev/v4l/by-id/usb-{number}-video-index0"
    return FoundCamera(Path(f"/dev/video{number}"), source, f"Webcam \x1b[{number}" + "x" * 400, modes=all_modes)


def host(folder: Path, found: list[FoundCamera], session: Mock, *, previews: bool = False) -> CameraHostServer:
    """A host on no network."""
    named, viewers = {"cam01": Stream("rtsp://user:secret@1.2.3.4/s")}, Viewers(folder, lambda _: ["false"])
    clock, opener = ManualClock(5), Mock()
    return CameraHostServer(session, "lab1", named, folder, clock, opener, lambda: found, viewers, previews=previews)


def test_cameras_are_announced_without_passwords_and_as_they_come_and_go(tmp_path):
    found, session = [camera(0)], Mock()
    server = host(tmp_path, found, session)
    first = server.announcement()
    assert [one.id for one in first.cameras] == ["cam01", "usb-0-video-index0"]
    assert first.cameras[0].source == "rtsp://1.2.3.4/s"
    assert first.cameras[1].stable
    found[:] = [camera(1)]
    server.look()
    assert [one.id for one in server.announcement().cameras] == ["cam01", "usb-1-video-index0"]
    assert session.serve.call_args.args[0] == "zenocap-cameras/lab1/film/usb-1-video-index0"
    lines = list(host_lines([server.announcement()]))
    assert "secret" not in "".join(lines)
    assert '  in a rig file: source = "discover:lab1/usb-1-video-index0"' in lines
    assert "  there: /dev/v4l/by-id/usb-1-video-index0" in lines
    assert "  MJPG 640 x 480: 30, 15 frames/s" in lines
    assert host_data([server.announcement()])[1]["machine"] == "lab1"


@pytest.mark.parametrize("previews", [False, True])
def test_films_leave_no_host_also_where_previews_may(tmp_path, previews):
    """A stranger's queryable received the queries of the one who films, with all that it took to read the film."""
    session = Mock()
    host(tmp_path, [], session, previews=previews)
    assign, film = (call.args[2] for call in session.serve.call_args_list)
    assert assign(AssignQuery(frame=1, captured_ns=0, what="state", rig="demo")).previews == previews
    state = film(FilmQuery(frame=1, captured_ns=0, what="state", sender="me"))
    assert (state.may_film, state.may_read) == (True, False)
    assert session.serve.call_args.args[4] == film.__self__.sender  # whose queries come first


def test_the_announcement_of_many_cameras_fits_into_a_message(tmp_path):
    announced = host(tmp_path, [camera(k, 200) for k in range(40)], Mock()).announcement()
    assert len(announced.cameras) == MOST_CAMERAS
    assert codec.decode(codec.encode(announced), type(announced)) == announced


def test_all_viewers_end_at_once(tmp_path, monkeypatch):
    """One after the other, each that hung kept the end of a machine's cameras for 8 s."""
    both, ended = threading.Barrier(2), []
    monkeypatch.setattr(FilmEndpoint, "close", lambda _: ended.append(both.wait(5.0)))
    host(tmp_path, [camera(0)], Mock()).close()
    assert sorted(ended) == [0, 1]


@pytest.mark.parametrize("text", ["", "a", "=0", "a=", "../a=0", ".a=0", "a/b=0", "a=film.mp4", "a=actor:demo"])
def test_other_cameras_are_refused(text):
    with pytest.raises(UserError, match=r"--camera .*: "):
        named_camera(text)


def test_a_second_program_that_answers_for_a_camera_is_found():
    place, film, assign = free_endpoint(), "zenocap-cameras/lab1/film/cam01", "zenocap-cameras/lab1/assign/cam01"
    query = FilmQuery(frame=1, captured_ns=0, what="state", sender="me")
    wish = AssignQuery(frame=1, captured_ns=0, what="state", rig="demo")
    common = {"frame": 1, "captured_ns": 0, "host": "lab1"}
    with ExitStack() as stack:
        true, stranger, own = (
            stack.enter_context(FilmSession.open(options)) for options in (listener(place), client(place), client(place))
        )
        for count, session in enumerate((true, stranger)):
            servers = [
                session.serve(film, FilmQuery, lambda _: FilmReply(**common, state="idle"), lambda: None),
                session.serve(assign, AssignQuery, lambda _: AssignReply(**common, state="free"), lambda: None),
            ]
            stack.callback(lambda servers=servers: [server.undeclare() for server in servers])
            until(lambda count=count: isinstance(own.ask(film, query, 2.0).get(film), (FilmReply, str)[count]), film)
            until(lambda count=count: isinstance(own.assign(assign, wish, 2.0), (AssignReply, str)[count]), assign)
        assert own.ask(film, query, 2.0) == {film: "2 programs answer for this camera: allowed: one"}
        assert own.assign(assign, wish, 2.0) == "2 programs answer for this camera: allowed: one"
