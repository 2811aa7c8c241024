"""The viewer that only makes silhouettes: one of every frame, the same as the two-view viewer's, and nothing else."""

from dataclasses import replace

import numpy as np
from two_view_run import EMPTY_FRAMES, EPOCH_NS, FRAME_NS, SIZE, Run, envelope, film, viewer_setup

from common import messages as m
from common.bus.protocol import Alive, Tick
from common.vision.packing import unpack
from services.viewer import step as two_view
from services.viewer import watching
from services.viewer.frame import Masked
from services.viewer.states import LearningBackground

COUNT = 30
SETUP = viewer_setup("1")


def played(count: int = COUNT, setup: object = SETUP) -> tuple[watching.State, list[m.Message]]:
    assert isinstance(setup, type(SETUP))
    state, said = watching.initial_state(setup), []
    for frames in film(COUNT)[:count]:
        state, messages = watching.step(setup, state, frames["1"])
        said += messages
    return state, said


def silhouettes(said: list[m.Message]) -> list[m.Silhouette]:
    return [message for message in said if isinstance(message, m.Silhouette)]


def test_while_it_learns_it_says_nothing() -> None:
    state, said = played(EMPTY_FRAMES - 1)
    assert said == []
    assert watching.describe(state) == f"learning the background ({EMPTY_FRAMES - 1} frames)"
    state, said = played(EMPTY_FRAMES)
    assert said == []
    assert watching.describe(state) == "silhouettes only, nobody in view"


def test_then_every_frame_has_its_silhouette_and_nothing_else() -> None:
    state, said = played()
    assert [type(message) for message in said] == [m.Silhouette] * (COUNT - EMPTY_FRAMES)
    assert [message.frame for message in said] == list(range(EMPTY_FRAMES, COUNT))
    assert [message.captured_ns for message in said] == [EPOCH_NS + k * FRAME_NS for k in range(EMPTY_FRAMES, COUNT)]
    assert watching.describe(state) == "silhouettes only"


def test_an_empty_view_is_said_too() -> None:
    """So that a view without a person is not taken for one that is late."""
    _, said = played(EMPTY_FRAMES + 1)
    (empty,) = silhouettes(said)
    assert (empty.size, empty.region, empty.data) == (SIZE, (0, 0, 0, 0), b"")
    assert not unpack(empty.size, empty.region, empty.data).any()


def test_its_silhouettes_are_those_of_the_two_view_viewer() -> None:
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


def test_previews_come_when_the_rig_asks_for_them() -> None:
    _, said = played(setup=replace(SETUP, publish_preview=True))
    previews = [message for message in said if isinstance(message, m.Preview)]
    times = [preview.captured_ns for preview in previews]
    assert np.all(np.diff(times) >= 200_000_000)
    assert len(silhouettes(said)) == COUNT - EMPTY_FRAMES


def test_it_listens_to_nobody() -> None:
    state, _ = played()
    bap = m.UniversalBap(
        frame=1, captured_ns=1, position=(0.0, 1.0, 0.0), angles={}, scores={}, views={}, stale=[], lost=[]
    )
    events: list[watching.Event] = [envelope(bap), Tick(1), Alive("integrator", "main", True, 1), Masked(1, 1, None)]
    for event in events:
        assert watching.step(SETUP, state, event) == (state, [])
    assert watching.step(SETUP, LearningBackground(), Tick(1)) == (LearningBackground(), [])
