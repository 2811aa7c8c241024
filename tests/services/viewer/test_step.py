"""Silhouette viewer: one silhouette per frame, as the two-view viewer's."""

from dataclasses import replace

import numpy as np

from tests.support.built_messages import built
from tests.support.two_view_run import EMPTY_FRAMES, EPOCH_NS, FRAME_NS, SIZE, Run, envelope, film, viewer_setup
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.viewer import step as silhouette_step
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.services.viewer.two_view import step as two_view

COUNT = 30
SETUP = viewer_setup("1")


def played(count: int = COUNT, setup: object = SETUP) -> tuple[silhouette_step.SilhouetteState, list[m.Message]]:
    assert isinstance(setup, type(SETUP))
    state, published = silhouette_step.initial_state(setup), []
    for frames in film(COUNT)[:count]:
        state, messages = silhouette_step.step(setup, state, frames["1"])
        published += messages
    return state, published


def silhouettes(published: list[m.Message]) -> list[m.Silhouette]:
    return [message for message in published if isinstance(message, m.Silhouette)]


def test_there_are_no_messages_while_the_background_is_learned() -> None:
    state, published = played(EMPTY_FRAMES - 1)
    assert published == []
    assert silhouette_step.describe(state) == f"learning the background ({EMPTY_FRAMES - 1} frames)"
    state, published = played(EMPTY_FRAMES)
    assert published == []
    assert silhouette_step.describe(state) == "silhouettes only, no person in view"


def test_every_later_frame_has_one_silhouette_and_no_other_message_but_advice() -> None:
    state, published = played()
    published = [message for message in published if not isinstance(message, m.CameraAdvice)]
    assert [type(message) for message in published] == [m.Silhouette] * (COUNT - EMPTY_FRAMES)
    assert [message.frame for message in published] == list(range(EMPTY_FRAMES, COUNT))
    assert [message.captured_ns for message in published] == [EPOCH_NS + k * FRAME_NS for k in range(EMPTY_FRAMES, COUNT)]
    assert silhouette_step.describe(state) == "silhouettes only"


def test_an_empty_view_is_published() -> None:
    """So that a view without a person differs from a late one."""
    _, published = played(EMPTY_FRAMES + 1)
    (empty,) = silhouettes(published)
    assert (empty.size, empty.region, empty.data) == (SIZE, (0, 0, 0, 0), b"")
    assert not unpack(empty.size, empty.region, empty.data).any()


def test_silhouettes_equal_those_of_the_two_view_viewer() -> None:
    run = Run()
    setup = replace(SETUP, publish_silhouette=True)
    state = run.viewers["1"]
    theirs: list[m.Silhouette] = []
    for frames in film(COUNT):
        state, messages = two_view.step(setup, state, frames["1"])
        theirs += silhouettes(messages)
    assert len(theirs) > 5
    ours = {message.frame: message for message in silhouettes(played()[1])}
    assert [ours[one.frame] for one in theirs] == theirs


def test_previews_are_published_when_enabled() -> None:
    _, published = played(setup=replace(SETUP, publish_preview=True))
    previews = [message for message in published if isinstance(message, m.Preview)]
    times = [preview.captured_ns for preview in previews]
    assert np.all(np.diff(times) >= 200_000_000)
    assert len(silhouettes(published)) == COUNT - EMPTY_FRAMES


def test_other_events_are_ignored() -> None:
    state, _ = played()
    bap = built(m.UniversalBap, frame=1, captured_ns=1)
    events: list[silhouette_step.Event] = [
        envelope(bap), Tick(1), Alive("integrator", "main", True, 1), SegmentedFrame(1, 1, None),
    ]  # fmt: skip
    for event in events:
        assert silhouette_step.step(SETUP, state, event) == (state, [])
    state = silhouette_step.initial_state(SETUP)
    assert silhouette_step.step(SETUP, state, Tick(1)) == (state, [])
