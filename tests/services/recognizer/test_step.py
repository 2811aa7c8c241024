"""Step of the recognizer: poses of its source as input, postures as output."""

from collections.abc import Iterable

import numpy as np
import pytest

from tests.support.built_messages import built
from tests.support.recognizer_cases import RATE, SECOND, actor_model, angles_of_posture
from tests.support.recognizer_cases import SIMULATED_POSTURES as NAMES
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.conversion import angles_by_name
from zenocap.common.topics import topic_of
from zenocap.services.recognizer.step import RecognizerSetup, RecognizerState, Source, counts, describe, initial_state, step
from zenocap.services.recognizer.stream import stream_setup

pytestmark = pytest.mark.slow
START = 1_700_000_000 * SECOND


def setup(source: Source = "integrator", anatomy: Anatomy = TEN_PARTS) -> RecognizerSetup:
    return RecognizerSetup(stream_setup(actor_model()), source, anatomy)


def bap(k: int, angles: np.ndarray, lost: bool = False) -> m.UniversalBap:
    return m.UniversalBap(
        frame=k, captured_ns=START + round(k * SECOND / RATE), position=(0.0, 1.0, 0.0),
        angles=angles_by_name(TEN_PARTS, angles), scores={}, views={}, stale=[], lost=["person"] if lost else [],
    )  # fmt: skip


def pose(k: int, angles: np.ndarray, anatomy: Anatomy = TEN_PARTS) -> m.TrackerPose:
    return built(
        m.TrackerPose, frame=k, captured_ns=START + round(k * SECOND / RATE), angles=angles_by_name(anatomy, angles),
        views=["1"],
    )  # fmt: skip


def run_steps(setup: RecognizerSetup, messages: Iterable[m.Message]) -> tuple[RecognizerState, list[m.Posture]]:
    state, found = initial_state(setup), []
    for message in messages:
        topic = topic_of(type(message))
        state, answers = step(setup, state, Envelope("key", topic, message, message.captured_ns))
        found += [answer for answer in answers if isinstance(answer, m.Posture)]
    return state, found


def test_postures_are_found_in_poses_of_the_integrator() -> None:
    angles = np.concatenate([angles_of_posture(name, 405, 0) for name in NAMES])
    state, found = run_steps(setup(), [bap(k, row) for k, row in enumerate(angles)])
    assert [posture.label for posture in found] == list(NAMES)
    for one in found:
        assert list(one.log_likelihoods) == list(NAMES)
        assert max(one.log_likelihoods, key=lambda name: one.log_likelihoods[name]) == one.label
        assert one.score >= one.margin > 0.0
        assert one.end_ns < one.captured_ns == START + round(one.frame * SECOND / RATE)
    assert describe(state) == "running; last event: kick-right"
    assert counts(state) == {"postures": 3}


@pytest.mark.nightly
def test_with_a_tracker_as_source_other_poses_are_ignored() -> None:
    angles = angles_of_posture("squat", 405, 0)
    poses, baps = [pose(k, row) for k, row in enumerate(angles)], [bap(k, row) for k, row in enumerate(angles)]
    assert [posture.label for posture in run_steps(setup("tracker"), poses)[1]] == ["squat"]
    assert run_steps(setup("tracker"), baps)[1] == run_steps(setup("integrator"), poses)[1] == []


def test_health_text_while_the_person_is_lost() -> None:
    standing = TEN_PARTS.neutral
    state, found = run_steps(setup(), [bap(k, standing, lost=k > 5) for k in range(30)])
    assert found == []
    assert describe(state) == "waiting for the person"
    assert describe(initial_state(setup())) == "waiting for poses"


def test_poses_of_another_anatomy_are_counted_and_ignored() -> None:
    state, found = run_steps(setup("tracker"), [pose(0, FOURTEEN_PARTS.neutral, FOURTEEN_PARTS)])
    assert (found, counts(state)) == ([], {"other_body": 1})


def test_late_poses_are_counted() -> None:
    state, _ = run_steps(setup(), [bap(k, TEN_PARTS.neutral) for k in (0, 1, 1, 0, 2, 40)])
    assert counts(state) == {"late": 2, "gap": 1}


def test_other_events_change_nothing() -> None:
    state = initial_state(setup())
    for event in (Tick(5), Alive("viewer", "1", True, 5)):
        assert step(setup(), state, event) == (state, [])
