"""Rivals: legs that are exchanged gather evidence, and take the estimate's place without a jump of the rest."""

from dataclasses import replace

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import BODY, MODEL, SETUP, STANDING, tracking
from tests.support.anatomies import each_anatomy
from tests.support.tracker_ring import FRAME_NS
from tests.support.tracker_scenes import rays_alone, tangent_rays
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.confidence import LEGS, limb_distances, limb_points
from zenocap.services.tracker.filter.filter_step import no_pose
from zenocap.services.tracker.filter.rivals import exchanged_legs, follow_rivals, rival_ambiguity
from zenocap.services.tracker.initialization.relocalization import check_other_postures, search_postures
from zenocap.services.tracker.parameters import RIVAL_FRAME, RIVAL_MOST, RIVAL_SWITCH
from zenocap.services.tracker.states import KNOWN_RIVALS, Outcome, Rival, Tracking

OUTCOME = no_pose(SETUP, lost=False)
UPPER = tuple(k for k, part in enumerate(FOURTEEN_PARTS.parts) if "leg" not in part and "foot" not in part)
IN_LEGS = np.array([any(one in name for one in ("hip", "knee", "ankle")) for name in coordinates_of(FOURTEEN_PARTS).names])


def stride(anatomy: Anatomy) -> RootedPose:
    return search_postures(anatomy)[3]._replace(position=np.array([0.1, 0.9, 0.2]))


RIGHT = stride(FOURTEEN_PARTS)
WRONG, CROSSED = exchanged_legs(FOURTEEN_PARTS, BODY, RIGHT)


def scene(pose: RootedPose, parts: tuple[int, ...] = ()) -> Evidence:
    return rays_alone(tangent_rays(MODEL, pose, 600, parts=parts))


def held(
    own: RootedPose, rivals: tuple[Rival, ...], evidence: Evidence, frames: int, **options: bool
) -> tuple[Tracking, Outcome]:
    """The track of a person who holds a pose, after some frame sets, or once the estimate is exchanged."""
    phase, outcome = replace(tracking(own), rivals=rivals), OUTCOME
    for k in range(1, frames + 1):
        after = replace(phase, captured_ns=k * FRAME_NS)
        phase, outcome = follow_rivals(SETUP, phase, after, OUTCOME, k * FRAME_NS, evidence, **{"seeking": False} | options)
        if outcome.pose is not None:
            break
    return phase, outcome


@each_anatomy
def test_exchanged_legs_have_the_other_one_ahead_or_the_places_of_each_other(anatomy: Anatomy) -> None:
    body, pose = average_body(anatomy, 1.75), stride(anatomy)
    ahead, crossed = exchanged_legs(anatomy, body, pose)
    np.testing.assert_array_equal(exchanged_legs(anatomy, body, ahead)[0].values, pose.values)
    there, mirrored, across = (
        limb_points(anatomy, model_of(anatomy, body), one)[:, LEGS] for one in (pose, ahead, crossed)
    )
    np.testing.assert_allclose(mirrored[:, ::-1] - pose.position, (there - pose.position) * [-1, 1, 1], atol=1e-9)
    np.testing.assert_allclose(across[:, ::-1], there, atol=0.08)


def test_rival_that_fits_better_takes_the_legs_and_leaves_all_else() -> None:
    before = tracking(WRONG)
    phase, outcome = held(WRONG, (Rival("legs", 0.0, RIGHT),), scene(RIGHT), 9)
    assert limb_distances(FOURTEEN_PARTS, MODEL, [phase.estimate], RIGHT).max() < 0.02
    for now, then in ((phase.estimate.values, WRONG.values), (phase.cloud.values, before.cloud.values)):
        np.testing.assert_array_equal(now[..., ~IN_LEGS], then[..., ~IN_LEGS])
    np.testing.assert_array_equal(phase.estimate.position, WRONG.position)
    np.testing.assert_array_equal(outcome.pose.angles, phase.estimate.pose(FOURTEEN_PARTS).angles)
    assert phase.rivals[0].nats < -RIVAL_SWITCH
    assert phase.corrected_ns > 0


@pytest.mark.parametrize("frames", [0, 150])
def test_rival_that_fits_as_well_stays_one_however_long_the_pose_is_held(frames: int) -> None:
    phase, _ = held(RIGHT, (Rival("legs", 1.0, WRONG),), scene(RIGHT, UPPER), frames)
    assert phase.estimate is RIGHT
    assert phase.rivals[0].nats == pytest.approx(1.0, abs=0.05)
    apart = limb_distances(FOURTEEN_PARTS, MODEL, [phase.rivals[0].pose], phase.estimate)[0]
    expected = apart * [0, 0, 1, 1] / (1 + np.exp(-phase.rivals[0].nats))
    np.testing.assert_allclose(rival_ambiguity(FOURTEEN_PARTS, phase), np.minimum(expected, 0.5), atol=0.01)


def test_scene_of_the_same_instant_is_no_evidence() -> None:
    phase = replace(tracking(WRONG), rivals=(Rival("legs", 0.0, RIGHT),))
    after, _ = follow_rivals(SETUP, phase, phase, OUTCOME, phase.captured_ns, scene(RIGHT), seeking=False)
    assert after.rivals[0].nats == pytest.approx(0.0, abs=0.01)


def test_rivals_are_found_where_they_fit_as_well_and_known_legs_stay_known() -> None:
    for rivals, nats in (((), 0.0), (KNOWN_RIVALS, -RIVAL_MOST)):
        phase, _ = held(RIGHT, rivals, scene(RIGHT, UPPER), 1, seeking=True)
        assert phase.rivals[0].nats == nats
        assert limb_distances(FOURTEEN_PARTS, MODEL, [phase.rivals[0].pose], RIGHT)[0, LEGS].min() > 0.08
    for pose, nats in ((RIGHT, -RIVAL_FRAME), (STANDING, 0.0)):  # the other legs do not fit, or are the same
        assert held(pose, (), scene(pose), 1, seeking=True)[0].rivals == (Rival("legs", nats),)


@pytest.mark.slow
def test_other_postures_do_not_decide_between_the_estimate_and_a_rival() -> None:
    for rivals, replaced in (((), True), ((Rival("legs", 0.0, RIGHT),), False)):
        phase = replace(tracking(WRONG, known=True), rivals=rivals)
        after, _ = check_other_postures(SETUP, phase, OUTCOME, FRAME_NS, scene(RIGHT))
        assert (after.estimate is not phase.estimate) == replaced
