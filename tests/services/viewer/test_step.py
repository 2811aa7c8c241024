"""Silhouette viewer: one silhouette per frame, as the two-view viewer's."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.built_messages import built
from tests.support.two_view_run import EMPTY_FRAMES, EPOCH_NS, FRAME_NS, SIZE, envelope, film, viewer_setup
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.vision.background import learn
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.viewer import segmentation
from zenocap.services.viewer import step as silhouette_step
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.services.viewer.states import LearningBackground
from zenocap.services.viewer.two_view import step as two_view

COUNT = 30
SETUP = viewer_setup("1")


def played(count: int = COUNT, setup=SETUP) -> tuple[silhouette_step.SilhouetteState, list[m.Message]]:
    state, published = silhouette_step.initial_state(setup), []
    for frames in film(COUNT)[:count]:
        state, messages = silhouette_step.step(setup, state, frames["1"])
        published += messages
    return state, published


def silhouettes(published: list[m.Message]) -> list[m.Silhouette]:
    return [message for message in published if isinstance(message, m.Silhouette)]


def test_there_are_no_messages_while_the_background_is_learned() -> None:
    learning, learned = f"learning the background ({EMPTY_FRAMES - 1} frames)", "silhouettes only, no person in view"
    for count, text in ((EMPTY_FRAMES - 1, learning), (EMPTY_FRAMES, learned)):
        state, published = played(count)
        assert (published, silhouette_step.describe(state)) == ([], text)


def test_many_frames_of_the_empty_scene_are_learnt_in_bounded_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of those spread over the whole time; fewer are kept all."""
    frames, kept = [np.full((48, 64, 3), k, np.uint8) for k in range(100)], []
    setup = replace(SETUP, background=FirstFrames(len(frames)))
    monkeypatch.setattr(segmentation.p, "LEARNT_PX", 16 * 48 * 64 + 5)
    monkeypatch.setattr(segmentation, "learn_from", kept.extend)
    state, scene, most = LearningBackground(), None, 0
    for frame in frames:
        assert scene is None
        state, scene = segmentation.learn(setup, state, frame)
        most = max(most, len(state.images))
    assert (scene is not None, most) == (True, 16)
    assert [int(image[0, 0, 0]) for image in kept] == list(range(0, 100, 8))
    monkeypatch.undo()
    state, scene = LearningBackground(), None
    for frame in frames:
        state, scene = segmentation.learn(setup, state, frame)
    assert scene is not None
    assert np.array_equal(scene.background.mean, learn(frames).mean)
    assert np.array_equal(scene.background.weight, learn(frames).weight)


def test_every_later_frame_has_one_silhouette_and_no_other_message_but_advice() -> None:
    state, published = played()
    found = [(type(one), one.frame, one.captured_ns) for one in published if not isinstance(one, m.CameraAdvice)]
    assert found == [(m.Silhouette, k, EPOCH_NS + k * FRAME_NS) for k in range(EMPTY_FRAMES, COUNT)]
    assert silhouette_step.describe(state) == "silhouettes only"


def test_an_empty_view_is_published() -> None:
    """So that a view without a person differs from a late one."""
    _, published = played(EMPTY_FRAMES + 1)
    (empty,) = silhouettes(published)
    assert (empty.size, empty.region, empty.data) == (SIZE, (0, 0, 0, 0), b"")
    assert not unpack(empty.size, empty.region, empty.data).any()


def test_silhouettes_equal_those_of_the_two_view_viewer() -> None:
    setup, state = replace(SETUP, publish_silhouette=True), two_view.initial_state(SETUP)
    theirs: list[m.Silhouette] = []
    for frames in film(COUNT):
        state, messages = two_view.step(setup, state, frames["1"])
        theirs += silhouettes(messages)
    assert len(theirs) > 5
    ours = {message.frame: message for message in silhouettes(played()[1])}
    assert [ours[one.frame] for one in theirs] == theirs


def test_previews_are_published_when_enabled() -> None:
    _, published = played(setup=replace(SETUP, publish_preview=True))
    times = [message.captured_ns for message in published if isinstance(message, m.Preview)]
    assert np.all(np.diff(times) >= 200_000_000)
    assert len(silhouettes(published)) == COUNT - EMPTY_FRAMES


def test_other_events_are_ignored() -> None:
    state, _ = played()
    bap = envelope(built(m.UniversalBap, frame=1, captured_ns=1))
    for event in (bap, Tick(1), Alive("integrator", "main", True, 1), SegmentedFrame(1, 1, None)):
        assert silhouette_step.step(SETUP, state, event) == (state, [])
    state = silhouette_step.initial_state(SETUP)
    assert silhouette_step.step(SETUP, state, Tick(1)) == (state, [])
