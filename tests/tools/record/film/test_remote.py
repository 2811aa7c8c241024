"""A camera that another program films: its failures, and copies that are whole or not there."""

import _thread
import hashlib
import itertools
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from msgspec import structs

from tests.services.camera.test_endpoint import SIZE, Camera
from tests.support.board_pictures import before, picture_of, plain_camera
from zenocap.common import codec
from zenocap.common.errors import UserError
from zenocap.common.messages import FilmBoard, FilmFile, FilmQuery, FilmReply
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import RealClock
from zenocap.common.video.parameters import RESERVE_BYTES
from zenocap.services.camera.endpoint import FilmEndpoint, Permission
from zenocap.tools.cli.calibrate.board_options import detect_command
from zenocap.tools.record.film import collect, remote
from zenocap.tools.record.film.collect import check_fetch, collected
from zenocap.tools.record.film.film import film
from zenocap.tools.record.film.places import Place
from zenocap.tools.record.film.remote import RemoteCamera
from zenocap.tools.record.film.remote_film import RemoteFilm
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.corners_file import packed
from zenocap.tools.setup.calibration.detection import detected

KEY = "key"


class Network:
    """A session whose one member is an endpoint.  changed: applied to each reply; None: no answer."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.changed = folder, lambda reply: reply
        self.picture = lambda: np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
        self.restart()

    def restart(self, camera: Camera | None = None, *, read: bool = True, **options: object) -> None:
        self.camera, permission = camera or Camera(), Permission(True, read)
        self.endpoint = FilmEndpoint(self.camera, "cam01", self.folder, permission, RealClock(), "lab1", **options)

    def ask(self, key: str, query: FilmQuery, timeout_s: float) -> dict[str, FilmReply | str]:
        reply = self.changed(self.endpoint.answer(codec.decode(codec.encode(query), FilmQuery)))
        return {} if reply is None else {key: reply}


@pytest.fixture
def network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Network]:
    """Gives images all the time."""
    monkeypatch.setattr(remote, "POLL_S", 0.05)
    monkeypatch.setattr(remote, "LOST_S", 0.5)
    monkeypatch.setattr(collect, "POLL_S", 0.01)
    net, stop = Network(tmp_path / "lab1"), threading.Event()

    def give() -> None:
        while not stop.wait(0.01):
            if net.camera.receive is not None:
                net.camera.receive(net.picture(), time.time_ns())

    thread = threading.Thread(target=give)
    thread.start()
    yield net
    stop.set()
    thread.join()


def remote_of(network: Network, *, secured: bool = True) -> RemoteFilm:
    query = FilmQuery(frame=0, captured_ns=0, what="state", sender="me")
    place = Place(KEY, network.ask(KEY, query, 1.0)[KEY], running=True)
    return RemoteFilm([RemoteCamera(network, demo_rig().viewers[0], place, "me", "walk")], secured)  # type: ignore[arg-type]


def filmed(network: Network, folder: Path, at_s: float, event: Callable[[], None]) -> tuple[RemoteFilm, int, str]:
    """A film of 1.5 s in which something happens after a time."""
    one = remote_of(network)
    timer = threading.Timer(1.0 + at_s, event)  # the film begins a second later
    timer.start()
    (result,), reason = film([], folder, 1.5, lambda: False, lambda _: None, remote=one)
    timer.join()
    return one, result.frames, reason


@pytest.mark.nightly
def test_a_program_that_was_started_anew_is_named_with_what_it_had(network: Network, tmp_path: Path) -> None:
    one, frames, reason = filmed(network, tmp_path / "out", 0.7, network.restart)
    assert reason == "cam01 on lab1: the program was started again; its film ended"
    assert frames > 10
    assert one.has_ended


@pytest.mark.nightly
def test_a_program_without_answer_is_given_up(network: Network, tmp_path: Path) -> None:
    _, frames, reason = filmed(network, tmp_path / "out", 0.5, lambda: setattr(network, "changed", lambda reply: None))
    assert reason == "cam01 on lab1: no answer for 0 s"
    assert frames > 10


@pytest.mark.nightly
def test_copies_are_whole_or_not_there(network: Network, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    one, frames, reason = filmed(network, folder, 0.5, lambda: None)
    assert (reason, frames > 50) == ("", True)

    def damaged(reply: FilmReply) -> FilmReply:
        data = bytes([*reply.data[:50], reply.data[50] ^ 1]) + reply.data[51:] if reply.data else b""
        return structs.replace(reply, data=data)

    network.changed = damaged
    notes, failures = collected(one, folder, fetch=True, report=print)
    assert failures == ["cam01: not copied: cam01 on lab1: cam01.mkv: the copy is not the original: wrong checksum"]
    assert not list(folder.rglob("cam01.mkv*"))
    assert notes["cam01"][0].startswith("on lab1:")
    lost = itertools.cycle([True, True, False])
    network.changed = lambda reply: None if next(lost) else reply
    notes, failures = collected(one, folder, fetch=True, report=print)
    assert failures == []
    copied, original = folder / "videos" / "cam01.mkv", tmp_path / "lab1" / "walk" / "videos" / "cam01.mkv"
    assert copied.read_bytes() == original.read_bytes()
    assert (folder / "times" / "cam01.csv").is_file()
    assert not list(folder.rglob("*.part"))


def false_film(network: Network, content: bytes, free: int, monkeypatch: pytest.MonkeyPatch, **told: int) -> RemoteFilm:
    """A camera that says to have filmed 10 frames of 5 kB, and gives `content` in place of both files.

    free: bytes on the disk at first.  told: size that it announces for both.
    """
    taken = itertools.count()

    def answer(query: FilmQuery) -> FilmReply:
        size = told.get("size", len(content))
        known = FilmFile(bytes=size, sha256=hashlib.sha256(content).hexdigest())
        files, data = {}, b""
        if query.what == "files":
            files = {"video": known, "times": known}
        if query.what == "read":
            data = content[query.offset : query.offset + (1 << 20)]
        return FilmReply(
            frame=query.frame, captured_ns=0, host="lab1", state="ended", may_film=True, may_read=True, film=query.film,
            folder="/films/walk", frames=10, written_bytes=50_000, files=files, data=data,
        )  # fmt: skip

    network.ask = lambda key, query, timeout_s: {key: answer(query)}  # type: ignore[method-assign]
    monkeypatch.setattr(collect.shutil, "disk_usage", lambda _: Mock(free=free - 100_000 * next(taken)))
    return remote_of(network)


@pytest.mark.parametrize(
    ("size", "told", "free", "text"),
    [
        (60_000, {}, RESERVE_BYTES + 10_000_000, ""),
        (60_000, {}, RESERVE_BYTES + 50_000, "0 MB: allowed: 0 MB, free disk"),
        (60_000, {"size": 50_000}, RESERVE_BYTES + 10_000_000, "not the 50000 bytes that it announced"),
        (60_000, {"size": 70_000}, RESERVE_BYTES + 10_000_000, "not the 70000 bytes that it announced"),
        (60_000, {"size": 1 << 40}, 1 << 50, "video: 1099511627776 bytes: allowed: 1099376 after 10 frames"),
        (1_060_000, {}, RESERVE_BYTES + 10_000_000, "times: 1060000 bytes: allowed: 1049376 after 10 frames"),
    ],
)
def test_a_false_machine_gets_no_more_of_the_disk_than_it_announced(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int, told: dict[str, int], free: int, text: str
) -> None:
    """And none of the reserve, which is looked at before each part: others write, too."""
    one = false_film(network, bytes(size), free, monkeypatch, **told)
    one.cameras[0].ask("state")
    _, failures = collected(one, tmp_path / "out", fetch=True, report=print)
    assert len(failures) == bool(text)
    assert text in "".join(failures)
    assert list((tmp_path / "out").rglob("*.part")) == []
    assert len(list((tmp_path / "out").rglob("cam01.*"))) == (0 if text else 2)


@pytest.mark.parametrize(("read", "secured"), [(False, True), (True, False)])
def test_a_film_that_could_not_be_copied_is_refused_before(network: Network, read: bool, secured: bool) -> None:
    """On an open network only a stranger offers one."""
    network.restart(read=read)
    with pytest.raises(UserError, match="cam01 on lab1: pictures do not leave that machine"):
        check_fetch(remote_of(network, secured=secured))


def test_on_an_open_network_nothing_is_copied_also_from_what_has_the_name_of_this_machine(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = false_film(network, bytes(1000), 10**12, monkeypatch)
    one.secured = False
    monkeypatch.setattr(collect.socket, "gethostname", lambda: "lab1")
    check_fetch(one)
    one.cameras[0].ask("state")
    assert collected(one, tmp_path / "out", fetch=True, report=print)[1] == []
    assert not list(tmp_path.rglob("cam01.*"))


BOARD = FilmBoard(kind="charuco", columns=5, rows=6, square_mm=35.0)


class BoardCamera(Camera):
    """Its images are of the size of the pictures of a board."""

    def size_and_rate(self, query: FilmQuery) -> tuple[tuple[int, int], float]:
        return (320, 240), 10.0


def board_film(network: Network, folder: Path) -> RemoteFilm:
    """A film of a board, at whose place pictures may not be read."""
    board, camera = checked_board("charuco", 5, 6, 35.0), plain_camera((320, 240), 300.0)
    network.restart(BoardCamera(), read=False, detect=detect_command)
    one, begin_s = remote_of(network), time.monotonic()
    pictures = [picture_of(board, camera, before(board, 0.5, (0.2, 0.1, 0.02 * k), (0.006 * k, 0.0))) for k in range(3)]
    network.picture = lambda: np.stack([pictures[int(10 * (time.monotonic() - begin_s)) % 3]] * 3, axis=-1)
    _, reason = film([], folder, 1.5, lambda: False, lambda _: None, remote=one)
    assert reason == ""
    return one


def test_a_search_of_a_board_ends_by_ctrl_c(network: Network, tmp_path: Path) -> None:
    """The command waited for the end of the search, up to an hour, and slept when another thread received the signal."""
    one, asked, most = remote_of(network), 0, 500
    (camera,) = one.cameras
    camera.reply = structs.replace(camera.reply, frames=5)

    def searching(reply: FilmReply) -> FilmReply:
        nonlocal asked
        asked += 1
        if asked == 2:
            _thread.interrupt_main()  # in the thread that searches: it wakes no other
        board = "searching" if asked < most else "failed"
        return structs.replace(reply, refused="", film=camera.film, frames=5, board=board)

    network.changed = searching
    with pytest.raises(KeyboardInterrupt):
        collected(one, tmp_path / "out", fetch=False, report=lambda _: None, board=BOARD)
    assert 2 <= asked < most


@pytest.mark.nightly
def test_corners_are_searched_there_and_copied_and_checked(network: Network, tmp_path: Path) -> None:
    """By the process that a viewer runs for it."""
    folder, reports = tmp_path / "out", []
    one = board_film(network, folder)
    notes, failures = collected(one, folder, fetch=False, report=reports.append, board=BOARD)
    assert failures == []
    assert reports == ["searching the board where the films are: cam01 on lab1"]
    assert notes["cam01"] == (f"on lab1:{network.folder / 'walk'}", "its corners copied, 0.0 MB")
    copied, video = folder / "corners" / "cam01.corners", network.folder / "walk" / "videos" / "cam01.mkv"
    assert copied.read_bytes() == packed(copied, detected(checked_board("charuco", 5, 6, 35.0), video, "cam01"))
    assert not list(folder.rglob("*.mkv*"))
    whole = copied.read_bytes()

    def false(data: bytes, size: int | None = None) -> Callable[[FilmReply], FilmReply]:
        """A program that gives other bytes than corners, with the right checksum."""
        known = FilmFile(bytes=len(data) if size is None else size, sha256=hashlib.sha256(data).hexdigest())

        return lambda reply: structs.replace(
            reply, files={"corners": known} if reply.files else {}, data=data if reply.data else b""
        )

    for data, size, words in (
        (b"no corners", None, "begins with b'no corners': allowed: b'zenocap corners"),
        (whole[:-1], None, "cut: "),
        (whole, (64 << 20) + 1, "67108865 bytes of corners: allowed: at most 67108864"),
        (packed(copied, detected(checked_board("charuco", 5, 6, 36.0), video, "cam01")), None, "board.square_m = 0.036"),
        (packed(copied, detected(checked_board("charuco", 5, 6, 35.0), video, "cam02")), None, "camera = 'cam02': allowed"),
    ):
        copied.unlink(missing_ok=True)
        network.changed = false(data, size)
        _, (failure,) = collected(one, folder, fetch=False, report=print, board=BOARD)
        assert failure.startswith("cam01: no corners: ")
        assert words in failure
        assert not list(folder.rglob("*.corners*"))
    network.changed = lambda reply: reply
    wrong = FilmBoard(kind="charuco", columns=5, rows=6, square_mm=35.0, marker_mm=40.0)
    _, (failure,) = collected(one, folder, fetch=False, report=print, board=wrong)
    assert "cam01: no corners: cam01 on lab1: --marker 40: allowed: 10.5 to less than 35 mm" in failure
