"""Live trial of a model: what the page shows of a rig's poses, without a network."""

import queue
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest
from msgspec import structs

from tests.support.live_cameras import until
from tests.support.posture_takes import NAMES, REPETITIONS, posture_take
from tests.tools.teach.page.test_session import Pages
from zenocap.common.bus.protocol import Bus, BusError, Envelope, Received
from zenocap.common.messages import UniversalBap
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.topics import Topic
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.tools.teach.dataset.generate import dataset_rig
from zenocap.tools.teach.page import live_trial
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.live_trial import LiveTrial
from zenocap.tools.teach.page.motion_view import MotionView, open_motion


class Network:
    """A bus that gives the events of a queue.  topics: that were subscribed to."""

    def __init__(self) -> None:
        self.events: queue.Queue[Received] = queue.Queue()
        self.topics: list[Topic] = []
        self.closed = threading.Event()

    def subscribe(self, topic: Topic) -> None:
        self.topics.append(topic)

    def receive(self, timeout_s: float) -> Received | None:
        try:
            return self.events.get(timeout=timeout_s)
        except queue.Empty:
            return None

    def close(self) -> None:
        self.closed.set()


@pytest.fixture(scope="module")
def model() -> PostureModel:
    return read_model(find_model("fifteen"))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return posture_take(tmp_path_factory.mktemp("take") / "monday.mcap")


@pytest.fixture(scope="module")
def take(path: Path) -> MotionView:
    return open_motion(path)


@pytest.fixture(scope="module")
def poses(path: Path) -> list[Envelope]:
    found = [envelope(one) for one in TakeReader(path).messages()]
    return [one for one in found if one is not None and isinstance(one.message, UniversalBap)]


def trial_on(network: Network) -> tuple[LiveTrial, list[pm.LiveUpdate]]:
    updates: list[pm.LiveUpdate] = []
    return LiveTrial(dataset_rig("truth"), updates.append, lambda ended: cast(Bus, network)), updates


@pytest.mark.nightly
def test_the_postures_of_a_rig_are_shown_and_counted(poses: list[Envelope], model: PostureModel) -> None:
    network = Network()
    trial, updates = trial_on(network)
    for one in poses:
        network.events.put(one)
    trial.start(model)
    until(lambda: len(updates) > 1 and all(dict(updates[-1].counts).get(name, 0) >= REPETITIONS for name in NAMES))
    until(network.events.empty)
    assert trial.running
    last = updates[-1]
    assert (last.state, last.text) == ("running", "recognizing")
    counts = dict(last.counts)
    assert [counts[name] for name in NAMES] == [REPETITIONS] * len(NAMES)
    assert [one.number for one in last.found] == sorted((one.number for one in last.found), reverse=True)
    assert all(0 <= one.confidence <= 1 and 0.2 < one.duration_s < 10 for one in last.found)
    trial.stop()
    assert updates[-1] == pm.LiveUpdate("off")
    assert not trial.running
    assert network.closed.is_set()


@pytest.mark.slow
def test_a_rig_without_poses_is_named(model: PostureModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_trial, "LIVE_SILENT_S", 0.2)
    trial, updates = trial_on(Network())
    trial.start(model)
    until(lambda: bool(updates) and "no poses come from rig demo" in updates[-1].text)
    trial.stop()


def test_a_network_that_cannot_be_joined_is_an_error_on_the_page(model: PostureModel) -> None:
    updates: list[pm.LiveUpdate] = []

    def refused(ended: Callable[[], bool]) -> Bus:
        raise BusError("tcp/10.0.0.9:7447: no answer")

    trial = LiveTrial(dataset_rig("truth"), updates.append, refused)
    trial.start(model)
    until(lambda: bool(updates) and updates[-1].state == "failed")
    assert updates[-1].text == "tcp/10.0.0.9:7447: no answer"
    until(lambda: not trial.running)


@pytest.mark.nightly
def test_poses_of_another_body_are_named_until_they_fit_again(poses: list[Envelope], model: PostureModel) -> None:
    network = Network()
    trial, updates = trial_on(network)
    trial.start(model)
    message = poses[0].message
    network.events.put(replace(poses[0], message=structs.replace(message, angles=[*message.angles, 0.0])))
    until(lambda: bool(updates) and "another body model" in updates[-1].text)
    network.events.put(poses[1])
    until(lambda: updates[-1].text == "recognizing")
    trial.stop()


@pytest.mark.nightly
def test_an_unexpected_error_does_not_look_like_recognizing(
    poses: list[Envelope], model: PostureModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(live_trial, "step", broken)
    monkeypatch.setattr(threading, "excepthook", lambda _: None)
    network = Network()
    trial, updates = trial_on(network)
    network.events.put(poses[0])
    trial.start(model)
    until(lambda: bool(updates) and updates[-1] == pm.LiveUpdate("failed", "ZeroDivisionError: a bug"))
    until(lambda: not trial.running)
    assert network.closed.is_set()


@pytest.mark.nightly
def test_without_a_rig_or_a_model_it_is_refused(take: MotionView, tmp_path: Path) -> None:
    without_rig = Pages(take, tmp_path / "one" / "examples.csv")
    wanted = "there is no rig: allowed after `zenocap posture label TAKE --rig RIG`"
    assert without_rig.send(pm.TryLive(on=True)) == wanted
    network = Network()
    pages = Pages(take, tmp_path / "two" / "examples.csv", live=trial_on(network)[0])
    assert pages.latest["hello"].rig == "demo"
    assert pages.send(pm.TryLive(on=True)) == "there is no model yet: allowed after Train"
    assert pages.send(pm.TryLive(on=False)) == ""
    assert network.topics == []
