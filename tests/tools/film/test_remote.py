"""A camera that another program films: its failures, and copies that are whole or not there."""

import itertools
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.services.viewer.film.test_endpoint import SIZE, Camera
from zenocap.common import codec
from zenocap.common.errors import UserError
from zenocap.common.messages import FilmQuery, FilmReply
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import RealClock
from zenocap.services.viewer.film.endpoint import FilmEndpoint, Permission
from zenocap.tools.film import collect, remote
from zenocap.tools.film.collect import check_fetch, collected
from zenocap.tools.film.film import film
from zenocap.tools.film.places import Place
from zenocap.tools.film.remote import RemoteCamera
from zenocap.tools.film.remote_film import RemoteFilm

KEY = "key"


class Network:
    """A session whose one member is an endpoint.  changed: applied to each reply; None: no answer."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.changed = folder, lambda reply: reply
        self.restart()

    def restart(self) -> None:
        self.camera = Camera()
        self.endpoint = FilmEndpoint(self.camera, "cam01", self.folder, Permission(True, True), RealClock(), "lab1")

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
                net.camera.receive(np.zeros((SIZE[1], SIZE[0], 3), np.uint8), time.time_ns())

    thread = threading.Thread(target=give)
    thread.start()
    yield net
    stop.set()
    thread.join()


def remote_of(network: Network) -> RemoteFilm:
    place = Place(
        KEY, network.ask(KEY, FilmQuery(frame=0, captured_ns=0, what="state", sender="me"), 1.0)[KEY], running=True
    )
    return RemoteFilm([RemoteCamera(network, demo_rig().viewers[0], place, "me", "walk")])  # type: ignore[arg-type]


def filmed(network: Network, folder: Path, at_s: float, event: Callable[[], None]) -> tuple[RemoteFilm, int, str]:
    """A film of 1.5 s in which something happens after a time."""
    one = remote_of(network)
    timer = threading.Timer(1.0 + at_s, event)  # the film begins a second later
    timer.start()
    (result,), reason = film([], folder, 1.5, lambda: False, lambda _: None, remote=one)
    timer.join()
    return one, result.frames, reason


def test_a_program_that_was_started_anew_is_named_with_what_it_had(network: Network, tmp_path: Path) -> None:
    one, frames, reason = filmed(network, tmp_path / "out", 0.7, network.restart)
    assert reason == "cam01 on lab1: the program was started anew; its film ended"
    assert frames > 10
    assert one.has_ended


def test_a_program_without_answer_is_given_up(network: Network, tmp_path: Path) -> None:
    def silent() -> None:
        network.changed = lambda reply: None

    _, frames, reason = filmed(network, tmp_path / "out", 0.5, silent)
    assert reason == "cam01 on lab1: no answer for 0 s"
    assert frames > 10


def test_copies_are_whole_or_not_there(network: Network, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    one, frames, reason = filmed(network, folder, 0.5, lambda: None)
    assert (reason, frames > 50) == ("", True)

    def damaged(reply: FilmReply) -> FilmReply:
        data = bytes([*reply.data[:50], reply.data[50] ^ 1]) + reply.data[51:] if reply.data else b""
        return FilmReply(**{name: getattr(reply, name) for name in reply.__struct_fields__} | {"data": data})

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


def test_a_film_that_could_not_be_copied_is_refused_before(network: Network, tmp_path: Path) -> None:
    network.endpoint = FilmEndpoint(network.camera, "cam01", tmp_path, Permission(film=True), RealClock(), "lab1")
    with pytest.raises(UserError, match="cam01 on lab1: pictures do not leave that machine"):
        check_fetch(remote_of(network))
