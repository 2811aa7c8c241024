"""The two-view method as printed and with single additions, from frames to poses."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs

from benchmarks.people.errors import estimate_of, frame_error
from tests.support.two_view_run import FPS, PERSON, POSTURE, SEED, Run, envelope, film, messages_of_kind
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.conversion import bdp_of
from zenocap.common.formats.take_poses import pose_of
from zenocap.common.rig.two_view import ADDITIONS, IMPROVED, PAPER, Additions
from zenocap.services.viewer.two_view import step as viewer
from zenocap.services.viewer.two_view.states import TrackingBody, TwoViewSetup
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import posture_timeline

pytestmark = pytest.mark.slow
COUNT = 60
TURNING = ("turn-and-walk", 110)
MOST_MM = 200.0  # mean joint error of a take; below the 250 mm at which a frame counts as lost


@cache
def tracked(additions: Additions, posture: str = POSTURE, count: int = COUNT) -> Run:
    run = Run(additions)
    for frames in film(count, posture):
        run.process(frames)
    return run


def mean_error_mm(run: Run) -> float:
    timeline, subject = posture_timeline(person(PERSON), POSTURE, SEED), person(PERSON)
    (*_, body) = messages_of_kind(run.published, m.UniversalBdp)
    errors = []
    for bap in messages_of_kind(run.published, m.UniversalBap):
        pose = timeline.pose_at(bap.frame / FPS)
        if pose is not None:
            found = estimate_of(TEN_PARTS, bdp_of(TEN_PARTS, body.body), pose_of(TEN_PARTS, bap))
            errors.append(float(frame_error(found, truth(subject, pose)).joints.mean()))
    assert len(errors) > 10
    return float(np.mean(errors))


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["paper", *ADDITIONS, "improved"])
def test_person_is_tracked_by_every_variant(name: str) -> None:
    named = {"paper": PAPER, "improved": IMPROVED}
    run = tracked(named.get(name, PAPER | {name}))
    assert mean_error_mm(run) < MOST_MM


@pytest.mark.nightly
@pytest.mark.parametrize("name", ADDITIONS)
def test_each_addition_alone_changes_what_is_published(name: str) -> None:
    # Some act only when legs cross or the person turns.
    runs = [tracked(additions, *TURNING) for additions in (PAPER | {name}, PAPER)]
    one, other = (messages_of_kind(run.published, m.UniversalBap) for run in runs)
    assert one != other


@pytest.mark.nightly
def test_matchings_of_a_search_are_those_of_equation_2() -> None:
    counts: dict[str, list[int]] = {"arm": [], "leg": []}
    for bap in messages_of_kind(tracked(PAPER).published, m.PartialBap):
        for name, limb in bap.limbs.items():
            counts[name.rpartition("_")[2]] += limb.matchings
    # Eq. 2: 3 matchings of the first stage, then 1 (a side region has won) or 2 (the middle one) for each of 3 or 2 stages.
    assert set(counts["arm"]) <= {6, 7, 8, 9}
    assert set(counts["leg"]) <= {5, 6, 7}
    assert len(set(counts["arm"])) > 1


@pytest.mark.nightly
@pytest.mark.parametrize(("additions", "used"), [(PAPER, True), (IMPROVED, False)])
def test_viewer_scales_its_model_by_the_factor_it_is_sent(additions: Additions, used: bool) -> None:
    run = tracked(additions)
    state = run.viewers["1"]
    assert isinstance(state, TrackingBody)
    setup = run.setups["1"]
    state, (sighting,) = viewer.step(setup, state, replace(film(COUNT)[-1]["1"], frame=COUNT))
    assert isinstance(sighting, m.Sighting)
    assert isinstance(state, TrackingBody)
    assert state.assignment is not None
    answers = [scaled(state.assignment, COUNT, factor) for factor in (1.0, 1.3)]
    scores = [partial_bap(setup, state, answer).score for answer in answers]
    assert (scores[0] != scores[1]) == used


@pytest.mark.parametrize("additions", [PAPER | {"restart"}, IMPROVED], ids=["paper", "improved"])
def test_lost_person_is_searched_at_the_depth_of_the_factor(additions: Additions) -> None:
    run = tracked(additions)
    state = run.viewers["1"]
    assert isinstance(state, TrackingBody)
    assert state.assignment is not None
    last = film(COUNT)[-1]["1"]
    moved = replace(last, frame=COUNT, image=np.roll(last.image, 40, axis=1))
    found = [
        viewer.step(run.setups["1"], replace(state, assignment=scaled(state.assignment, COUNT, factor)), moved)
        for factor in (1.0, 1.3)
    ]
    (near,), (far,) = (messages for _, messages in found)
    assert near != far


def scaled(assignment: m.Assignment, frame: int, factor: float) -> m.Assignment:
    """The same assignment for another frame, with scaling factors multiplied by `factor`."""
    views = {
        id: structs.replace(each, frame=frame, scale=each.scale * factor, stale=False)
        for id, each in assignment.views.items()
    }
    return structs.replace(assignment, views=views)


def partial_bap(setup: TwoViewSetup, state: TrackingBody, answer: m.Assignment) -> m.PartialBap:
    _, (message,) = viewer.step(setup, state, envelope(answer))
    assert isinstance(message, m.PartialBap)
    return message
