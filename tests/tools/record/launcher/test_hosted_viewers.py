"""Viewers that other machines run: assigned, and every likely mistake named with what to type where."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.common.rig.test_hosted import rig
from tests.support.live_cameras import until
from zenocap.common.messages import AssignQuery, AssignReply, CameraHost, HostCamera
from zenocap.common.rig.hosted import assignment, hosted_cameras
from zenocap.tools.record.launcher import hosted_viewers
from zenocap.tools.record.launcher.hosted_viewers import ANSWER_S, RELEASE_S, HostedViewers, secured_advice


def host(k: int, instance: str = "i", camera: str = "cam") -> CameraHost:
    cameras = [HostCamera(id=camera, source="rtsp://1.2.3.4/s")]
    return CameraHost(
        frame=0, captured_ns=1, machine=f"lab{k}", host=f"pc{k}{instance}", cameras=cameras, instance=instance
    )


class Session:
    """A network of these hosts, which obey unless `reply` is replaced."""

    def __init__(self) -> None:
        self.present = [host(0), host(1)]
        self.asked: list[tuple[str, AssignQuery]] = []
        self.waits: dict[str, float] = {}  # for the last answer (s)
        self.reply: Callable[[str], AssignReply | str | None] = lambda _: self.good()

    def good(self, **changes: object) -> AssignReply:
        fields = {"frame": 0, "captured_ns": time.time_ns(), "host": "pc", "state": "running"} | changes
        return AssignReply(**fields)

    def hosts(self, timeout_s: float, machine: str = "*") -> list[CameraHost | str]:
        return [*self.present, "CameraHost: not a map"]

    def assign(self, key: str, query: AssignQuery, timeout_s: float) -> AssignReply | str | None:
        self.asked.append((key, query))
        self.waits[key] = timeout_s
        return self.reply(key)

    def close(self) -> None:
        pass


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> Session:
    monkeypatch.setattr(hosted_viewers, "PERIOD_S", 0.01)
    monkeypatch.setattr(hosted_viewers, "PATIENCE_S", 0.05)
    return Session()


def viewers(session: Session, folder: Path) -> HostedViewers:
    one = rig(folder)
    return HostedViewers(session, hosted_cameras(one), lambda id: assignment(one, id, 5))  # type: ignore[arg-type]


def news_of(running: HostedViewers, wanted: int = 2) -> list[str]:
    """The first texts."""
    found = list[str]()
    running.start()
    follow(running, found, lambda: len(found) >= wanted)
    running.close()
    return found


def follow(running: HostedViewers, found: list[str], is_enough: Callable[[], bool]) -> None:
    """Add news to `found` until they are enough."""
    until(lambda: found.extend(running.news()) or is_enough(), "the news")


def test_viewers_are_assigned_again_and_again_and_released(session, tmp_path):
    assert news_of(viewers(session, tmp_path)) == ["viewer 0 runs on lab0", "viewer 1 runs on lab1"]
    time.sleep(0.05)
    assert [(key, query.what) for key, query in session.asked[:2]] == [
        ("zenocap-cameras/lab0/assign/cam", "assign"), ("zenocap-cameras/lab1/assign/cam", "assign"),
    ]  # fmt: skip
    assert [(query.what, query.rig) for _, query in session.asked[-2:]] == [("release", "studio")] * 2


def test_all_cameras_are_given_back_at_once(session, tmp_path):
    """One after the other, each of a machine that is frozen kept the end for 10 s."""
    both, released = threading.Barrier(2), list[int]()

    def reply(_: str) -> AssignReply:
        if session.asked[-1][1].what == "release":
            released.append(both.wait(5.0))
        return session.good()

    session.reply = reply
    news_of(viewers(session, tmp_path))
    assert sorted(released) == [0, 1]


@pytest.mark.parametrize(
    ("present", "text"),
    [
        ([], "no machine lab1 announces its cameras (there are: none): run there: zenocap viewer --discover"),
        ([host(0)], "(there are: lab0)"),
        ([host(1, camera="other")], "lab1 has no camera cam (there are: other): plug it in, or run there: zenocap viewer"),
        ([host(1, "a"), host(1, "b")], "two machines announce as lab1: pc1a and pc1b: run one of them with another"),
    ],
    ids=["none", "another-one", "without-the-camera", "twice"],
)
def test_a_machine_that_is_missing_or_there_twice_is_named(session, tmp_path, present, text):
    session.present = present
    found = news_of(viewers(session, tmp_path))
    assert any(line.startswith("viewer 1: ") and text in line for line in found), found
    assert "zenocap-cameras/lab1/assign/cam" not in [key for key, _ in session.asked]


@pytest.mark.parametrize(
    ("reply", "text"),
    [
        (None, "does not answer: it is away, or has an older zenocap: install the same release there"),
        ("AssignReply: the sender has wire version 7", "where that is another release: install the same there"),
        (
            {"refused": "the camera is used by viewer 1 of rig lab"},
            "refused by lab0: the camera is used by viewer 1 of rig",
        ),
        ({"state": "waiting", "failure": "no\x1bimage"}, "failed on lab0, which starts it again: no\\x1bimage"),
    ],
    ids=["no-answer", "another-release", "refused", "failed"],
)
def test_a_machine_that_does_not_run_the_viewer_is_named_with_the_reason(session, tmp_path, reply, text):
    session.reply = lambda _: session.good(**reply) if isinstance(reply, dict) else reply
    found = news_of(viewers(session, tmp_path))
    assert any(line.startswith("viewer 0: ") and text in line for line in found), found


def test_a_machine_that_vanishes_is_named_and_gets_its_viewer_again(session, tmp_path):
    running, found = viewers(session, tmp_path), []
    running.start()

    for present, text in (
        ([host(0), host(1)], "viewer 1 runs on lab1"),
        ([host(0)], "viewer 1: no machine lab1 announces"),
        ([host(0), host(1, "again")], "viewer 1 runs on lab1"),
    ):
        found.clear()
        session.present = present
        follow(running, found, lambda text=text: any(text in line for line in found))
    running.close()
    assert running.never_ran == []


def test_a_machine_that_does_not_answer_keeps_the_end_no_longer_than_an_answer(session, tmp_path):
    """One that was frozen just before it kept it for the 10 s in which a viewer may end."""
    running, found = viewers(session, tmp_path), []
    running.start()
    follow(running, found, lambda: len(found) == 2)
    session.present = [host(1)]
    running.close()
    assert list(session.waits.values()) == [ANSWER_S, RELEASE_S]


def test_a_viewer_that_never_ran_and_a_clock_far_off_are_named(session, tmp_path):
    session.present = [host(0)]
    session.reply = lambda _: session.good(captured_ns=time.time_ns() + 3_600_000_000_000)
    running = viewers(session, tmp_path)
    found = news_of(running, 3)
    assert "note: the clock of lab0 is 3600 s ahead: corrected for tracking; its logs and films have that time" in found
    (text,) = running.never_ran
    assert text.startswith("viewer 1 has not run: no machine lab1 announces")


def test_a_secured_rig_says_what_to_run_where(tmp_path):
    lines = list(secured_advice(hosted_cameras(rig(tmp_path)), tmp_path / "rig.toml"))
    assert lines[1].endswith("the certificate viewer-1 to lab1 and run there: zenocap viewer rig.toml --id 1")
