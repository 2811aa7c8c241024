"""Rivals: exchanged legs and headings gather evidence, and take the estimate's place."""

from dataclasses import replace

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import MODEL, SETUP, STANDING, rays, reversed_of, tracking
from tests.services.tracker.initialization.test_twins import stride
from tests.support.tracker_ring import FRAME_NS, ahead, played, ring, setup, simulated_person
from tests.support.tracker_scenes import rays_alone, tangent_rays
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter import rivals
from zenocap.services.tracker.filter.confidence import LEGS, confidences, limb_distances
from zenocap.services.tracker.filter.filter_step import no_pose
from zenocap.services.tracker.filter.rivals import (
    follow_rivals,
    heading_nats,
    nats_against,
    rival_ambiguity,
    with_heading,
    with_rivals,
)
from zenocap.services.tracker.initialization.decisions import by_decision
from zenocap.services.tracker.initialization.postures import turned_start
from zenocap.services.tracker.initialization.relocalization import check_other_postures, turn_between
from zenocap.services.tracker.initialization.twins import exchanged_legs, mirrored_about_feet
from zenocap.services.tracker.parameters import (
    AMBIGUITY_SCALE,
    LOST_LIMB,
    MIRROR_MET,
    REACH_MOST,
    RIVAL_ALIKE,
    RIVAL_APART_M,
    RIVAL_FITS,
    RIVAL_MET,
    RIVAL_MOST,
    RIVAL_SWITCH,
)
from zenocap.services.tracker.states import HEADING_KINDS, Outcome, Rival, RivalKind, Tracking, refuted
from zenocap.simulation.body.pose import LEFT, RIGHT, Foot, Placement, neutral, place

OUTCOME = no_pose(SETUP, lost=False)
UPPER = tuple(k for k, part in enumerate(FOURTEEN_PARTS.parts) if "leg" not in part and "foot" not in part)
SEED = 3
IN_LEGS = np.array([any(one in name for one in ("hip", "knee", "ankle")) for name in coordinates_of(FOURTEEN_PARTS).names])
STRIDE = stride(FOURTEEN_PARTS)
WRONG = exchanged_legs(FOURTEEN_PARTS, STRIDE)


def scene(pose: RootedPose, parts: tuple[int, ...] = ()) -> Evidence:
    return rays_alone(tangent_rays(MODEL, pose, 300, parts=parts))


def held(
    start: RootedPose | Tracking, rivals: tuple[Rival, ...], evidence: Evidence, frames: int, *sought: RivalKind
) -> tuple[Tracking, Outcome]:
    """The track of a person who holds a pose, after some frame sets, or once the estimate is exchanged."""
    phase, outcome = start if isinstance(start, Tracking) else tracking(start), OUTCOME
    phase = replace(phase, rivals=(*phase.rivals, *rivals))
    for _ in range(frames):
        after = replace(phase, captured_ns=phase.captured_ns + FRAME_NS)
        phase, outcome = follow_rivals(SETUP, phase, after, OUTCOME, after.captured_ns, evidence, sought)
        if outcome.pose is not None:
            break
    return phase, outcome


def rival_of(phase: Tracking, kind: RivalKind) -> Rival:
    return next(one for one in phase.rivals if one.kind == kind)


def test_rival_that_fits_better_takes_the_legs_and_leaves_all_else() -> None:
    before = tracking(WRONG)
    phase, outcome = held(WRONG, (Rival("legs", 0.0, STRIDE),), scene(STRIDE), 9)
    assert limb_distances(FOURTEEN_PARTS, MODEL, [phase.estimate], STRIDE).max() < 0.02
    for now, then in ((phase.estimate.values, WRONG.values), (phase.cloud.values, before.cloud.values)):
        np.testing.assert_array_equal(now[..., ~IN_LEGS], then[..., ~IN_LEGS])
    np.testing.assert_array_equal(phase.estimate.position, WRONG.position)
    np.testing.assert_array_equal(outcome.pose.angles, phase.estimate.pose(FOURTEEN_PARTS).angles)
    assert phase.rivals[0].nats < -RIVAL_SWITCH
    assert phase.corrected_ns > 0


@pytest.mark.parametrize("frames", [0, 150])
def test_rival_that_fits_as_well_stays_one_however_long_the_pose_is_held(frames: int) -> None:
    phase, _ = held(STRIDE, (Rival("legs", 1.0, WRONG),), scene(STRIDE, UPPER), frames)
    assert phase.estimate is STRIDE
    assert phase.rivals[0].nats == pytest.approx(1.0, abs=0.05)
    apart = limb_distances(FOURTEEN_PARTS, MODEL, [phase.rivals[0].pose], phase.estimate)[0]
    expected = np.minimum(apart, 0.5) * [0, 0, 1, 1] / (1 + np.exp(-phase.rivals[0].nats))
    np.testing.assert_allclose(rival_ambiguity(FOURTEEN_PARTS, phase), expected, atol=0.01)


def test_feet_in_each_others_places_are_found_and_taken_with_the_trunk() -> None:
    wrong, _ = mirrored_about_feet(FOURTEEN_PARTS, MODEL, STRIDE)
    phase, outcome = held(wrong, refuted(*HEADING_KINDS), scene(STRIDE), 60, "feet")
    assert outcome.pose is not None
    assert limb_distances(FOURTEEN_PARTS, MODEL, [phase.estimate], STRIDE)[0, LEGS].max() < RIVAL_APART_M
    assert turn_between(phase.estimate, STRIDE) < turn_between(wrong, STRIDE)
    assert rival_of(phase, "feet").nats < -RIVAL_SWITCH


@pytest.mark.parametrize(("logs", "nats"), [(0.0, 0.0), (0.19, 0.0), (-0.19, 0.0), (0.4, -1.0), (-0.4, 1.0)])
def test_misfits_that_are_nearly_equal_prove_nothing(logs: float, nats: float) -> None:
    phase = tracking(STANDING)
    step = rivals._Step(SETUP, phase, phase, FRAME_NS, scene(STANDING))
    assert rivals._shown(step, "legs", STANDING, float(np.exp(logs))) == pytest.approx(nats)


def test_legs_that_have_met_are_less_certain() -> None:
    phase, _ = held(STANDING, (Rival("legs", -RIVAL_MOST, STANDING),), scene(STANDING), 1)
    assert phase.rivals[0] == Rival("legs", -RIVAL_MET * RIVAL_MOST)


def test_scene_of_the_same_instant_is_no_evidence() -> None:
    phase = replace(tracking(WRONG), rivals=(Rival("legs", 0.0, STRIDE),))
    after, _ = follow_rivals(SETUP, phase, phase, OUTCOME, phase.captured_ns, scene(STRIDE), ())
    assert after.rivals[0].nats == pytest.approx(0.0, abs=0.01)


def test_rivals_are_found_where_they_fit_as_well_and_known_legs_stay_known() -> None:
    heading = refuted(*HEADING_KINDS)
    for before, nats in (((), 0.0), (refuted("legs"), -RIVAL_MOST)):
        phase, _ = held(STRIDE, (*before, *heading), scene(STRIDE, UPPER), 1, "legs")
        assert phase.rivals[0].nats == nats
        assert limb_distances(FOURTEEN_PARTS, MODEL, [phase.rivals[0].pose], STRIDE)[0, LEGS].min() > 0.08
    assert held(STANDING, heading, scene(STANDING), 1, "legs")[0].rivals[:2] == (Rival("legs"), Rival("feet"))  # the same


@pytest.mark.parametrize(("kind", "most"), [("legs", -np.log(RIVAL_FITS) / AMBIGUITY_SCALE), ("first mirror", -RIVAL_MOST)])
def test_rival_that_does_not_fit_is_one_observation_however_long_the_pose_is_held(kind: RivalKind, most: float) -> None:
    evidence = scene(STRIDE)
    once, often = (rival_of(held(STRIDE, (), evidence, frames, kind)[0], kind) for frames in (1, 4))
    assert once.pose is None
    assert -RIVAL_MOST <= once.nats <= most
    assert often.nats == pytest.approx(max(-RIVAL_MOST, once.nats * (1.0 + 3e-9 * FRAME_NS)))


def test_opposite_heading_is_found_and_taken_unless_the_user_has_decided() -> None:
    wrong = tracking(reversed_of(STANDING))
    for start, opposite in ((wrong, False), (by_decision(wrong, 0), True)):
        phase, _ = held(start, (), rays_alone(rays()), 60, "back")
        assert (phase.estimate.rotation[:, 2] @ STANDING.rotation[:, 2] < 0.0) == opposite
        assert phase.person.heading_known == (heading_nats(phase) < -RIVAL_SWITCH)
    assert heading_nats(phase) == -RIVAL_MOST


def test_heading_is_known_once_its_rivals_are_refuted_and_doubted_when_one_gains() -> None:
    phase, _ = held(STANDING, (), rays_alone(rays()), 1, *HEADING_KINDS)
    assert phase.person.heading_known  # no other heading fits in a ring of cameras
    doubted, _ = held(phase, (Rival("back", 0.0),), rays_alone(rays()), 1)
    assert not doubted.person.heading_known


@pytest.mark.parametrize("pose", [None, turned_start(STANDING, STANDING.position, -0.1)])
def test_mirrored_heading_that_meets_the_estimate_may_be_exchanged_with_it_later(pose: RootedPose | None) -> None:
    """Which way a person turns who faces a camera: the heading is known, and another one soon possible again."""
    phase = tracking(turned_start(STANDING, STANDING.position, -0.4), known=True)
    rivals = (Rival("back", -RIVAL_MOST), Rival("first mirror", -RIVAL_MOST, pose), Rival("second mirror", -RIVAL_MOST))
    phase = replace(phase, rivals=rivals)
    after = replace(phase, captured_ns=phase.captured_ns + FRAME_NS)
    phase, _ = follow_rivals(setup(ring(2)), phase, after, OUTCOME, after.captured_ns, rays_alone(rays()), ["first mirror"])
    assert rival_of(phase, "first mirror") == Rival("first mirror", -MIRROR_MET)
    assert phase.person.heading_known


@pytest.mark.parametrize(
    ("probability", "nats", "known"), [(0.0, RIVAL_MOST, False), (0.6, -0.405, False), (0.9, -2.197, True)]
)
def test_heading_of_a_probability_has_rivals_of_the_others_odds(probability: float, nats: float, known: bool) -> None:
    phase = with_heading(tracking(STANDING, known=True), probability)
    assert heading_nats(phase) == pytest.approx(nats, abs=1e-3)
    assert phase.person.heading_known == known


@pytest.mark.parametrize(
    ("errors", "reaches", "best"),
    [
        ((1.0, 1.05), (-0.02, 0.02), 1),  # feet that point forward outweigh a misfit that is 5 % worse,
        ((1.0, 2.0), (-0.005, 0.005), 0),  # and not one that is twice as large
        ((1.05, 1.0), (None, None), 1),
        ((1.0, 1.05), (None, REACH_MOST), 0),  # feet that are not seen show nothing
        ((1.05, 1.0), (None, -0.01), 0),
    ],
)
def test_most_probable_pose_is_that_of_misfit_and_feet(
    errors: tuple[float, ...], reaches: tuple[float | None, ...], best: int
) -> None:
    assert np.argmin(nats_against(1e-3 * np.array(errors), reaches)) == best


def test_rivals_among_poses_are_the_most_probable_of_each_kind_that_differ() -> None:
    aside, legs = turned_start(STRIDE, STRIDE.position, 1.5), STRIDE._replace(values=WRONG.values)
    poses = [STRIDE, legs, WRONG, reversed_of(STRIDE), aside]
    phase = with_rivals(FOURTEEN_PARTS, tracking(STRIDE), poses, np.array([0.0, -2.0, -1.0, -1e3, -3.0]))
    assert [(one.kind, one.nats) for one in phase.rivals] == [
        ("legs", -1.0),
        ("second mirror", -3.0),
        ("back", -RIVAL_MOST),
    ]
    assert [one.pose for one in phase.rivals] == [WRONG, aside, poses[3]]


@pytest.mark.slow
def test_other_postures_take_no_rival_that_fits_alike_and_another_heading_has_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    legs, back = Rival("legs", 0.0, STRIDE), Rival("back", 2.0)
    for alike, pose, before, replaced, left in (
        (100.0, WRONG, (), True, ()),
        (100.0, WRONG, (legs,), False, (legs,)),
        (RIVAL_ALIKE, WRONG, (legs,), True, (legs,)),  # it fits clearly better
        (100.0, WRONG, (back,), True, (back,)),
        (100.0, reversed_of(STRIDE), (back,), True, ()),
    ):
        monkeypatch.setattr("zenocap.services.tracker.parameters.RIVAL_ALIKE", alike)
        phase = replace(tracking(pose, known=pose is WRONG), rivals=before)
        after, _ = check_other_postures(SETUP, phase, OUTCOME, FRAME_NS, scene(STRIDE))
        apart = limb_distances(FOURTEEN_PARTS, MODEL, [after.estimate], STRIDE)[0, LEGS].max()
        assert (apart < RIVAL_APART_M) == replaced
        assert after.rivals == left


@pytest.mark.nightly
@pytest.mark.parametrize("yaw_deg", [0.0, 120.0, 180.0, 300.0])
def test_held_step_before_two_cameras_has_the_right_leg_ahead_or_legs_of_little_confidence(yaw_deg: float) -> None:
    yaw, standing = np.radians(yaw_deg), neutral(simulated_person(SEED))
    standing.feet[[RIGHT, LEFT], Foot.Z] += [0.175, -0.175]
    state, outcomes, _ = played(setup(ring(2)), SEED, [place(standing, Placement(yaw=yaw))] * 120)
    centres = joint_centres(FOURTEEN_PARTS, state.phase.person.body, outcomes[-1].pose)
    right, left = (centres[[one.name for one in FOURTEEN_PARTS.markers].index(name)] for name in ("RAnkle", "LAnkle"))
    limbs, _ = confidences(outcomes[-1].limb_features, None)
    assert (right - left) @ ahead(yaw) > 0.2 or max(limbs["right_leg"], limbs["left_leg"]) < LOST_LIMB
