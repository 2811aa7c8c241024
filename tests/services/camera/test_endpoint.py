"""Film endpoint of a camera's program: obeyed and refused queries."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from tests.support.live_cameras import until
from zenocap.common import codec
from zenocap.common.messages import FilmBoard, FilmQuery, FilmReply
from zenocap.common.rig.rig import demo_rig
from zenocap.common.rig.sources import Device
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.video.reader import VideoReader
from zenocap.services.camera.board_search import Command
from zenocap.services.camera.endpoint import FilmEndpoint, Permission, filming_of
from zenocap.services.camera.feeds import CameraFeed
from zenocap.services.camera.parameters import FILM_LEASE_S, OPEN_S
from zenocap.services.camera.recorder import Recorder

SIZE, S = (64, 48), 1_000_000_000
ALL = Permission(film=True, read=True)
BOARD = FilmBoard(kind="charuco", columns=5, rows=7, square_mm=35.0)


@dataclass
class Camera:
    """A feed whose images the test gives."""

    away: int = 0
    failure: str = ""
    receive: Callable[..., None] | None = None
    opened: list[str] = field(default_factory=list)

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        return SIZE, 10.0

    def open(self, query: FilmQuery, receive: Callable[..., None]) -> None:
        self.receive = receive
        self.opened.append(str(query.film))

    def close(self) -> None:
        self.receive = None


class Place:
    """An endpoint with its camera and clock."""

    def __init__(
        self, folder: Path, permission: Permission = ALL, free: int = 10**12, detect: Command | None = None
    ) -> None:
        self.camera, self.clock, self.folder = Camera(), ManualClock(1000 * S), folder / "films"
        self.endpoint = FilmEndpoint(
            self.camera, "cam01", self.folder, permission, self.clock, "lab1", free_bytes=lambda _: free, detect=detect
        )

    def ask(self, what: str, sender: str = "me", film: str | None = "walk", **fields: object):
        query = FilmQuery(frame=1, captured_ns=0, what=what, sender=sender, film=film, **{"camera": "cam01"} | fields)
        return codec.decode(codec.encode(self.endpoint.answer(query)), FilmReply)

    def image(self, at_s: float) -> None:
        self.clock.set(round(at_s * S))
        if self.camera.receive is not None:
            self.camera.receive(np.zeros((SIZE[1], SIZE[0], 3), np.uint8), round(at_s * S))

    def filmed(self, duration_s: float = 0.0) -> None:
        """Film from 1001 s on."""
        assert self.ask("open").state == "opening"
        self.image(1000.5)
        assert self.ask("state").state == "ready"
        reply = self.ask("start", begin_ns=1001 * S, duration_ns=round(duration_s * S))
        assert (reply.refused, reply.state) == ("", "filming")

    def refuses(self, text: str, *whats: str, **fields: object) -> None:
        """Queries are refused with a text, and nothing of a film is given."""
        for what in whats:
            reply = self.ask(what, **fields)
            assert text in reply.refused
            assert (reply.data, reply.files, reply.board) == (b"", {}, "none")

    def ended(self) -> FilmReply:
        """Film one image."""
        self.filmed()
        self.image(1001.5)
        return self.ask("stop")


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_images_of_the_interval_and_no_others_are_recorded(place, tmp_path):
    place.filmed(duration_s=1.0)
    for k in range(5, 25):
        place.image(1000 + k / 10)
    reply = place.ask("state")
    assert (reply.state, reply.failure, reply.frames) == ("ended", "", 10)
    assert (reply.first_ns, reply.last_ns) == (1001 * S, round(1001.9 * S))
    assert reply.folder == str(tmp_path / "films" / "walk")
    with VideoReader(tmp_path / "films" / "walk" / "videos" / "cam01.mkv") as reader:
        assert sum(1 for _ in iter(reader.next, None)) == 10
    assert place.camera.receive is None
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {"cam01.mkv", "cam01.csv"}


def test_nothing_is_obeyed_without_permission(tmp_path):
    place = Place(tmp_path, Permission())
    for what in ("open", "start", "stop", "files", "read"):
        assert "may not be filmed: allowed with film = true" in place.ask(what).refused
    reply = place.ask("state")
    assert (reply.refused, reply.may_film, place.camera.opened) == ("", False, [])
    assert list(tmp_path.iterdir()) == []


def test_pictures_stay_without_permission_to_read(tmp_path):
    place = Place(tmp_path, Permission(film=True))
    assert place.ended().frames == 1
    place.refuses("pictures do not leave this machine", "files", "read")


@pytest.mark.parametrize("name", ["..", "../x", "a/b", "/etc", ".hidden", "a\nb", "a\x1b", "", "a\n"])
@pytest.mark.parametrize("key", ["film", "camera"])
def test_names_that_lead_elsewhere_are_no_message(name, key):
    query = {"frame": 1, "captured_ns": 0, "what": "open", "sender": "me", "film": "walk", "camera": "cam01"} | {key: name}
    with pytest.raises(codec.BadMessage):
        codec.encode(FilmQuery(**query))


def test_one_film_at_a_time_and_only_of_the_own_camera(place):
    assert "camera = 'cam02': allowed: cam01" in place.ask("open", camera="cam02").refused
    place.filmed()
    assert "film walk is being recorded: allowed: one at a time" in place.ask("open", "other", "run").refused
    assert place.ask("state").state == "filming"
    place.image(1001.5)
    place.ask("stop")
    assert "exists: allowed: another name" in place.ask("open").refused
    assert place.ask("open", "other", "run").refused == ""


def test_images_of_a_size_that_another_program_chooses_do_not_fill_the_memory(tmp_path):
    """60 of them waited for the writer: 6 GB at 6680 x 5010 px, whatever the camera gives."""
    feed = CameraFeed(Device(0), lambda *_: iter(()))
    endpoint = FilmEndpoint(feed, None, tmp_path, ALL, ManualClock(S), "lab1")
    query = FilmQuery(frame=1, captured_ns=0, what="open", sender="me", film="a", camera="b", size=(16384, 16384))
    assert "size = [16384, 16384]: allowed: 67108864 pixels at most" in endpoint.answer(query).refused
    assert list(tmp_path.iterdir()) == []
    recorder = Recorder(tmp_path / "a.mkv", tmp_path / "a.csv", (6680, 5010), 10.0)
    assert recorder._queue.maxsize * 3 * 6680 * 5010 < 1e9
    recorder.end()


def test_nobody_else_starts_stops_or_reads_a_film(place):
    place.filmed()
    place.image(1001.5)
    place.refuses("opened by another program", "stop", sender="stranger")
    assert place.ask("state", "stranger").folder == ""
    assert place.ask("stop").state == "ended"
    place.refuses("opened by another program", "files", "read", sender="stranger")
    assert place.ask("read").data[:4] == b"\x1aE\xdf\xa3"  # Matroska


def test_a_film_ends_when_its_commander_is_gone(place):
    place.filmed()
    for k in range(int(FILM_LEASE_S) - 2):
        place.image(1001.5 + k)
        place.ask("state", "stranger")  # does not keep it alive
        assert place.endpoint.sender() == "me"
        place.endpoint.check()
    assert place.endpoint.is_recording
    place.image(1001.5 + FILM_LEASE_S)
    place.endpoint.check()
    reply = place.ask("state")
    assert (reply.state, reply.failure) == ("ended", "who filmed is gone: no query for 10 s")
    assert reply.frames >= FILM_LEASE_S - 2


def test_an_opened_film_that_is_not_started_gives_the_camera_back(place, tmp_path):
    place.ask("open")
    for k in range(int(OPEN_S) + 2):
        place.image(1000.0 + k)
        place.ask("state")
    assert place.ask("state").failure == "not started within 60 s"
    assert place.camera.receive is None
    assert not list(tmp_path.rglob("*.mkv"))


def test_a_start_far_off_is_refused(place):
    place.ask("open")
    assert "the camera is not ready: opening" in place.ask("start", begin_ns=1000 * S).refused
    place.image(1000.5)
    for begin_ns in (2000 * S, 0):
        assert "allowed: -10 to 60 s" in place.ask("start", begin_ns=begin_ns).refused


def test_on_a_full_disk_no_film_is_opened(tmp_path):
    assert "0 MB free: allowed: at least 500 MB" in Place(tmp_path, free=10).ask("open").refused


@pytest.mark.parametrize(
    ("event", "failure"),
    [
        (lambda place: setattr(place.camera, "failure", "unplugged"), "unplugged"),
        (lambda place: place.endpoint.close(), "the program that has the camera was ended"),
    ],
    ids=["the-camera-fails", "the-program-ends"],
)
def test_a_film_is_ended_in_order(place, event, failure):
    place.filmed()
    place.image(1001.5)
    event(place)
    reply = place.ask("state")
    assert (reply.state, reply.failure, reply.frames) == ("ended", failure, 1)


def test_a_link_in_the_folder_of_films_is_not_followed(place, tmp_path):
    (tmp_path / "films").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "films" / "walk").symlink_to(tmp_path / "elsewhere")
    assert "a link: allowed: a folder" in place.ask("open").refused
    assert list((tmp_path / "elsewhere").iterdir()) == []


def script(text: str) -> Command:
    """A process that has the video and the folder of the corners as its arguments, in place of the search of a board."""
    return lambda board, video, folder: [
        sys.executable, "-c", f"import pathlib, sys, time\n{text}", str(video), str(folder),
    ]  # fmt: skip


WRITES = script(
    "folder = pathlib.Path(sys.argv[2])\nfolder.mkdir()\n"
    "(folder / 'cam01.corners').write_bytes(b'corners of ' + pathlib.Path(sys.argv[1]).name.encode())"
)


def searched(place: Place) -> FilmReply:
    """The reply after a search of a board in a film."""
    place.ended()
    assert place.ask("detect", board=BOARD).refused == ""
    until(lambda: place.ask("state").board != "searching", "the end of the search")
    return place.ask("state")


@pytest.mark.core
def test_corners_may_be_read_where_pictures_may_not_and_by_nobody_else(tmp_path):
    place = Place(tmp_path, Permission(film=True), detect=WRITES)
    reply = searched(place)
    assert (reply.board, reply.board_failure) == ("found", "")
    until(lambda: place.ask("files", file="corners").files["corners"].sha256 != "", "the checksum")
    files = place.ask("files", file="corners").files
    assert (set(files), files["corners"].bytes) == ({"corners"}, 20)
    assert place.ask("read", file="corners").data == b"corners of cam01.mkv"
    for file in ("video", "times"):
        assert "pictures do not leave this machine" in place.ask("read", file=file).refused
    place.refuses("opened by another program", "detect", "files", "read", sender="stranger", file="corners", board=BOARD)
    assert {path.parent for path in tmp_path.rglob("*.*")} == {
        tmp_path / "films" / "walk" / folder for folder in ("videos", "times", "corners")
    }


@pytest.mark.core
def test_a_search_is_refused_or_ended_with_the_reason(tmp_path):
    place = Place(tmp_path / "none")
    place.ended()
    assert "no board is searched here: allowed: `zenocap calibrate detect`" in place.ask("detect", board=BOARD).refused
    place = Place(tmp_path / "failing", detect=script("sys.exit('error: no markers are seen')"))
    place.filmed()
    assert "the film has not ended" in place.ask("detect", board=BOARD).refused
    place.image(1001.5)
    place.ask("stop")
    assert "board: a description is missing" in place.ask("detect").refused
    assert "there are no corners of a board" in place.ask("read", file="corners").refused
    (tmp_path / "failing" / "films" / "walk" / "corners").symlink_to(tmp_path)
    assert "a link: allowed: a folder" in place.ask("detect", board=BOARD).refused
    reply = searched(Place(tmp_path / "other", detect=script("sys.exit('error: no markers are seen')")))
    assert (reply.board, reply.board_failure) == ("failed", "no markers are seen")
    assert searched(Place(tmp_path / "silent", detect=script("sys.exit(5)"))).board_failure == "exit status 5"
    assert searched(Place(tmp_path / "nothing", detect=script(""))).board == "failed"


@pytest.mark.core
@pytest.mark.parametrize(
    ("is_gone", "words"),
    [(True, "who filmed is gone: no query for 10 s"), (False, "the program that has the camera was")],
    ids=["commander-gone", "program-ended"],
)
def test_a_search_ends_with_its_commander_and_with_the_program(tmp_path, is_gone, words):
    place = Place(tmp_path, detect=script("time.sleep(600)"))
    place.ended()
    place.ask("detect", board=BOARD)
    place.ask("detect", board=BOARD)  # asked again, it goes on
    assert "a board is being searched in film walk" in place.ask("open", "other", "run").refused
    assert place.ask("state").board == "searching"
    if is_gone:
        place.clock.set(round((1002.5 + FILM_LEASE_S) * S))
        place.endpoint.check()
    else:
        place.endpoint.close()
    reply = place.ask("state")
    assert (reply.board, words in reply.board_failure) == ("failed", True)
    assert place.ask("open", "other", "run").refused == ""


@pytest.mark.parametrize("secured", [False, True])
def test_films_of_a_running_viewer_leave_its_machine_with_certificates_only(tmp_path, secured):
    endpoint = filming_of(demo_rig(), demo_rig().viewers[0].id, tmp_path, secured=secured)(Camera(), ManualClock(S))
    assert endpoint.answer(FilmQuery(frame=1, captured_ns=0, what="state", sender="me")).may_read == secured
