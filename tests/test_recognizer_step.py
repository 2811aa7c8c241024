"""The recogniser's step: poses of its source in, postures out."""

from collections.abc import Iterable

import numpy as np
import pytest
from recognizer_cases import ACTED as NAMES
from recognizer_cases import RATE, SECOND, actor_model, angles_of_posture

from common import messages as m
from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from common.bus.protocol import Alive, Envelope, Tick
from common.conversion import angles_by_name
from common.topics import topic_of
from services.recognizer.model import PostureModel
from services.recognizer.states import Setup, Source, State
from services.recognizer.step import counts, describe, initial_state, step
from services.recognizer.stream import plan_of

START = 1_700_000_000 * SECOND


@pytest.fixture(scope="module")
def model() -> PostureModel:
    return actor_model()


def setup(model: PostureModel, source: Source = "integrator", anatomy: Anatomy = TEN_PARTS) -> Setup:
    return Setup(plan_of(model), source, anatomy)


def bap(k: int, angles: np.ndarray, lost: bool = False) -> m.UniversalBap:
    return m.UniversalBap(
        frame=k, captured_ns=START + round(k * SECOND / RATE), position=(0.0, 1.0, 0.0),
        angles=angles_by_name(TEN_PARTS, angles), scores={}, views={}, stale=[], lost=["person"] if lost else [],
    )  # fmt: skip


def pose(k: int, angles: np.ndarray, anatomy: Anatomy = TEN_PARTS) -> m.TrackerPose:
    return m.TrackerPose(
        frame=k, captured_ns=START + round(k * SECOND / RATE), position=(0.0, 1.0, 0.0),
        angles=angles_by_name(anatomy, angles), position_spread=(0.0, 0.0, 0.0), spread={}, likelihood=0.0, effective=1.0,
        lost=False, views=["1"],
    )  # fmt: skip


def fed(setup: Setup, messages: Iterable[m.Message]) -> tuple[State, list[m.Posture]]:
    state, said = initial_state(setup), []
    for message in messages:
        topic = topic_of(type(message))
        state, answers = step(setup, state, Envelope("key", topic, message, message.captured_ns))
        said += [answer for answer in answers if isinstance(answer, m.Posture)]
    return state, said


def test_poses_of_the_integrator_become_postures(model: PostureModel) -> None:
    angles = np.concatenate([angles_of_posture(name, 403, 0) for name in NAMES])
    state, said = fed(setup(model), [bap(k, row) for k, row in enumerate(angles)])
    assert [posture.label for posture in said] == list(NAMES)
    for one in said:
        assert list(one.log_likelihoods) == list(NAMES)
        assert max(one.log_likelihoods, key=lambda name: one.log_likelihoods[name]) == one.label
        rows = round((one.end_ns - one.start_ns) / SECOND * RATE) + 1
        best, second = sorted(one.log_likelihoods.values(), reverse=True)[:2]
        assert one.margin == pytest.approx((best - second) / rows)
        assert one.end_ns < one.captured_ns == START + round(one.frame * SECOND / RATE)
    assert describe(state) == "listening; the last was kick-right"
    assert counts(state) == {"postures": 3}


def test_a_recogniser_of_a_tracker_heeds_its_poses_alone(model: PostureModel) -> None:
    angles = angles_of_posture("squat", 403, 0)
    poses, baps = [pose(k, row) for k, row in enumerate(angles)], [bap(k, row) for k, row in enumerate(angles)]
    assert [posture.label for posture in fed(setup(model, "tracker"), poses)[1]] == ["squat"]
    assert fed(setup(model, "tracker"), baps)[1] == fed(setup(model, "integrator"), poses)[1] == []


def test_a_person_who_is_lost_is_waited_for(model: PostureModel) -> None:
    standing = TEN_PARTS.neutral
    state, said = fed(setup(model), [bap(k, standing, lost=k > 5) for k in range(30)])
    assert said == []
    assert describe(state) == "waiting for the person"
    assert describe(initial_state(setup(model))) == "waiting for poses"


def test_poses_of_another_body_are_counted_and_left_out(model: PostureModel) -> None:
    state, said = fed(setup(model, "tracker"), [pose(0, FOURTEEN_PARTS.neutral, FOURTEEN_PARTS)])
    assert (said, counts(state)) == ([], {"other_body": 1})


def test_late_poses_are_counted(model: PostureModel) -> None:
    state, _ = fed(setup(model), [bap(k, TEN_PARTS.neutral) for k in (0, 1, 1, 0, 2, 40)])
    assert counts(state) == {"late": 2, "gap": 1}


def test_other_events_do_nothing(model: PostureModel) -> None:
    state = initial_state(setup(model))
    for event in (Tick(5), Alive("viewer", "1", True, 5)):
        assert step(setup(model), state, event) == (state, [])
