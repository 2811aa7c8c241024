"""Tracking of one frame in a viewer: sighting, then limbs."""

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.segments import (
    LIMBS,
    YAW_OFFSETS,
    Limb,
    hanging_arm,
    limb_angles,
    limb_directions,
    limbs_of,
    torso_rotation,
    width_thresholds,
)
from zenocap.common.conversion import angles_by_name
from zenocap.common.messages import Assignment, LimbMatch, Message, PartialBap, Sighting
from zenocap.common.vision.model_image import ADD, REMOVE
from zenocap.services.viewer.parameters import LOST_LIMBS, LOST_PERSON, RESTART_GAIN, USUAL_SCORE_FALL, USUAL_SCORE_RISE
from zenocap.services.viewer.two_view.body_fit import BodyFit, cropped
from zenocap.services.viewer.two_view.joint_angles import (
    LEFT_LEG,
    RIGHT_LEG,
    find_arm,
    find_leg_facade,
    find_leg_flank,
    leg_exchange_gain,
)
from zenocap.services.viewer.two_view.limb_fit import LimbResult
from zenocap.services.viewer.two_view.limb_hypotheses import arm_hypotheses, combination, hypothesis_scores, leg_hypotheses
from zenocap.services.viewer.two_view.paper import joint_angles as paper
from zenocap.services.viewer.two_view.paper.joint_angles import LimbAngles
from zenocap.services.viewer.two_view.paper.projection import depth_of_scale, orthographic, point_at, shift
from zenocap.services.viewer.two_view.position import TorsoEstimate, estimate_torso, tilt_of, turn_scores
from zenocap.services.viewer.two_view.silhouette_features import own_view, silhouette_box, toes_offset, upper_body_width
from zenocap.services.viewer.two_view.states import Pending, TrackingBody, TwoViewSetup

NO_SCORES = np.empty(0)


def torso_of(setup: TwoViewSetup, angles: Floats) -> Floats:
    """(3, 3) torso to world of joint angles (angles,)."""
    index = setup.anatomy.index
    return torso_rotation(*(float(angles[index[f"navel.{axis}"]]) for axis in "yxz"))


def sighting(setup: TwoViewSetup, state: TrackingBody, pending: Pending) -> tuple[TrackingBody, Sighting]:
    """Position, tilt and turn of the body in this view, searched from the last universal BAP.  [Two-view 3.1, 3.2]"""
    added = setup.additions
    pose = state.pose
    torso = torso_of(setup, pose.angles)
    directions = limb_directions(setup.anatomy, pose.angles)
    rows, depth = _projection(setup, state)
    fit = BodyFit(state.model, *cropped(rows, pending.mask), pending.mask.shape[0])
    start = _start(setup, state, depth)
    found = _torso(setup, fit, start, torso, directions)
    # Paper (added): a person who moved too far is searched at the torso of the silhouette.
    if "restart" in added and state.usual_score and found.score < LOST_PERSON * state.usual_score:
        found = _relocalized(setup, pending.mask, fit, depth, torso, directions, found.score) or found
    local = setup.rows[:3] @ found.position + setup.rows[3]
    box = silhouette_box(pending.mask)
    focal, (_, cy) = setup.level.focal_px(), setup.level.centre_px()
    torso_px = float(state.model.torso[0]) * focal / local[2]
    width = upper_body_width(pending.mask, cy + focal * local[1] / local[2], torso_px)
    metres = width * local[2] / focal
    # Paper (replaced): 3.1 compares widths in px; here in metres at the depth of the person.
    low, high = width_thresholds(2 * float(state.model.torso[2]), 2 * float(state.model.torso[1]))
    before = state.assignment.views[setup.id].view if state.assignment else "facade"
    arms = legs = NO_SCORES
    if "hypotheses" in added:
        last = _last(setup, state, torso)
        resting = hanging_arm(torso, float(pose.angles[setup.anatomy.index["navel.y"]]))
        arms = hypothesis_scores(fit, 0, arm_hypotheses(last, resting))
        legs = hypothesis_scores(fit, RIGHT_LEG, leg_hypotheses(last))
    toes = float(np.clip(toes_offset(pending.mask) * local[2] / focal, -1, 1)) if "toes" in added else 0.0
    # Paper (replaced): 4.2 takes the column of the highest pixel as the position; here that of the matched model.
    message = Sighting(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, present=True,
        x=float(local[0] / local[2]), y=float(local[1] / local[2]), height=box.height / focal, width=width / focal,
        view=own_view(before, metres, low, high), score=found.score, tilt=found.tilt, turns=list(found.turns),
        toes=toes, arms=arms.tolist(), legs=legs.tolist(), based_on=state.based_on,
    )  # fmt: skip
    return replace(state, pending=replace(pending, model=state.model, ray=(message.x, message.y))), message


def _projection(setup: TwoViewSetup, state: TrackingBody) -> tuple[Floats, float]:
    """Camera rows (5, 3) of the model image and depth of the person, metres."""
    # Paper (replaced): 3.2 draws an orthographic model scaled by r_t; with the addition perspective, in perspective.
    if state.assignment is None:
        depth = float(setup.rows[2] @ state.pose.position + setup.rows[3, 2])
    else:
        depth = depth_of_scale(setup.rows, state.assignment.views[setup.id].scale)
    return (setup.rows if "perspective" in setup.additions else orthographic(setup.rows, depth)), depth


def _start(setup: TwoViewSetup, state: TrackingBody, depth: float) -> Floats:
    """(3,) position from which the body is searched."""
    start = state.pose.position
    if "perspective" in setup.additions:
        return start
    x, y, z = setup.rows[:3] @ start + setup.rows[3]
    return point_at(setup.rows, float(x / z), float(y / z), depth)


def _torso(setup: TwoViewSetup, fit: BodyFit, start: Floats, torso: Floats, directions: Floats) -> TorsoEstimate:
    """Torso searched from `start` (3,): by the additions, or by the paper's shifts alone."""
    if "position" in setup.additions:
        tilted, turned = "tilt" in setup.additions, "turn" in setup.additions
        return estimate_torso(fit, start, torso, directions, tilted=tilted, turned=turned)
    found = shift(fit, start, torso, directions)
    turns: tuple[float, ...] = ()
    tilt = 0.0
    if "tilt" in setup.additions:
        tilt = tilt_of(fit, found.position.copy(), torso.copy(), directions.copy())
        fit.place(found.position, torso, directions)
    if "turn" in setup.additions:
        scores = turn_scores(found.position, torso, directions, fit.model, fit.image, YAW_OFFSETS)
        turns = tuple(float(score) for score in scores)
        fit.place(found.position, torso, directions)
    return TorsoEstimate(found.position, found.score, tilt, turns)


def _relocalized(
    setup: TwoViewSetup, mask: Mask, fit: BodyFit, depth: float, torso: Floats, directions: Floats, score: float
) -> TorsoEstimate | None:
    """Estimate from the torso of the silhouette instead of the last position; None when it scores no higher."""
    box = silhouette_box(mask)
    focal, (cx, cy) = setup.level.focal_px(), setup.level.centre_px()
    local = np.array([(box.column - cx) / focal, (box.navel_row - cy) / focal, 1.0]) * depth
    position = setup.rows[:3].T @ (local - setup.rows[3])
    found = _torso(setup, fit, position, torso, directions)
    return found if found.score > score else None


def limbs(
    setup: TwoViewSetup, state: TrackingBody, pending: Pending, assignment: Assignment
) -> tuple[TrackingBody, list[Message]]:
    """Partial BAP of the pending frame, with the torso as the integrator assigned it.  [Two-view 3.3, 3.4]"""
    anatomy, added = setup.anatomy, setup.additions
    if pending.model is None:
        return replace(state, pending=None), []
    torso = torso_rotation(assignment.yaw, assignment.lean, assignment.roll)
    rows, position = setup.rows, np.array(assignment.position)
    if "perspective" not in added:  # as printed in [Two-view 4.2]: the model scaled by the factor that was sent
        depth = depth_of_scale(setup.rows, assignment.views[setup.id].scale)
        rows, position = orthographic(setup.rows, depth), point_at(setup.rows, *pending.ray, depth)
    fit = BodyFit(pending.model, *cropped(rows, pending.mask), pending.mask.shape[0])
    last = _last(setup, state, torso)
    resting = hanging_arm(torso, assignment.yaw)
    if assignment.arms:
        last[:2] = combination(arm_hypotheses(last, resting), assignment.arms)
    if assignment.legs:
        last[2:] = combination(leg_hypotheses(last), assignment.legs)
    fit.place(position, torso, last)
    search = _search_directions if "directions" in added else _search_angles
    angles, results = search(setup, state, fit, assignment, lost=False)
    # Paper (added): limbs whose score falls are searched all around; see 5.2 (1).
    lost = "restart" in added and fit.score() < LOST_LIMBS * state.usual_score
    if lost:
        angles, results = search(setup, state, fit, assignment, lost=True)
    score = fit.score()
    rate = USUAL_SCORE_RISE if score > state.usual_score else USUAL_SCORE_FALL
    usual_score = state.usual_score + rate * (score - state.usual_score)
    view = assignment.views[setup.id].view
    gain = leg_exchange_gain(fit) if view == "facade" and "exchange" in added else 0.0
    if "directions" in added:
        angles = limb_angles(anatomy, fit.directions, state.pose.angles)
    named = angles_by_name(anatomy, angles)
    message = PartialBap(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, view=view,
        angles={name: named[name] for limb in limbs_of(anatomy) for name in _angle_names(anatomy, limb)},
        limbs={
            LIMBS[k]: LimbMatch(score=max(float(r.score), 0.0), visible=float(r.visible), matchings=list(r.matchings))
            for k, r in sorted(results.items())
        },
        exchange=float(gain), score=float(score), based_on=state.based_on,
    )  # fmt: skip
    return replace(state, pending=None, assignment=assignment, usual_score=usual_score, lost=lost), [message]


def _search_directions(
    setup: TwoViewSetup, state: TrackingBody, fit: BodyFit, assignment: Assignment, *, lost: bool
) -> tuple[Floats, dict[int, LimbResult]]:
    """Limbs searched as directions, which stay in the fit: the last angles (angles,), and the result of each limb."""
    torso = fit.torso_to_world
    resting = hanging_arm(torso, assignment.yaw)
    standing = np.tile(torso.T @ np.array([0.0, -1.0, 0.0]), (2, 1))
    facade = assignment.views[setup.id].view == "facade"
    results: dict[int, LimbResult] = {}
    # Paper (replaced): 3.3 and 3.4 estimate the arms first; here the legs.
    for k in (RIGHT_LEG, LEFT_LEG):
        if facade:
            results[k] = find_leg_facade(fit, k, assignment.squatting)
        else:
            results[k] = find_leg_flank(fit, k, standing, lost)
    for k in (0, 1):
        results[k] = find_arm(fit, k, resting, lost, restart="restart" in setup.additions)
    return state.pose.angles, results


def _search_angles(
    setup: TwoViewSetup, state: TrackingBody, fit: BodyFit, assignment: Assignment, *, lost: bool
) -> tuple[Floats, dict[int, LimbResult]]:
    """Limbs searched angle by angle, as printed: angles (angles,) radians, and the result of each limb."""
    # As printed in [Two-view 3.3, 3.4]: arms before legs; with the addition restart also from other angles.
    anatomy, facade = setup.anatomy, assignment.views[setup.id].view == "facade"
    angles = limb_angles(anatomy, fit.directions, state.pose.angles)  # of the directions that the fit was placed with
    results: dict[int, LimbResult] = {}
    for k, limb in enumerate(limbs_of(anatomy)):
        start = LimbAngles(*(float(angles[n]) for n in (limb.z, limb.x, limb.y, limb.flexion)))
        found, results[k] = _search_limb(fit, k, limb, anatomy.limits, start, assignment.squatting, facade)
        for other in paper.other_starts(start, limb.is_leg, facade, lost) if "restart" in setup.additions else ():
            kept = fit.directions[k].copy()
            retried, result = _search_limb(fit, k, limb, anatomy.limits, other, assignment.squatting, facade)
            if result.score >= results[k].score + RESTART_GAIN:
                found, results[k] = retried, result
            else:
                fit.cover_limb(k, REMOVE)
                fit.directions[k] = kept
                fit.cover_limb(k, ADD)
        angles[[limb.z, limb.x, limb.y, limb.flexion]] = found.z, found.x, found.y, found.bend
    return angles, results


def _search_limb(
    fit: BodyFit, k: int, limb: Limb, limits: Floats, start: LimbAngles, squatting: bool, facade: bool
) -> tuple[LimbAngles, LimbResult]:
    """Limb k searched angle by angle from `start`; limits: (angles, 2) radians."""
    if not limb.is_leg:
        return (paper.find_arm_facade if facade else paper.find_arm_flank)(fit, k, start)
    if facade:
        return paper.find_leg_facade(fit, k, start, limits[limb.z], squatting)
    return paper.find_leg_flank(fit, k, start, limits[limb.x], limits[limb.flexion])


def _last(setup: TwoViewSetup, state: TrackingBody, torso: Floats) -> Floats:
    """(4, 2, 3) limb directions of the last pose in the frame of `torso` (3, 3)."""
    directions: Floats = limb_directions(setup.anatomy, state.pose.angles) @ torso_of(setup, state.pose.angles).T @ torso
    return directions


def _angle_names(anatomy: Anatomy, limb: Limb) -> list[str]:
    return [anatomy.angles[k] for k in (limb.z, limb.x, limb.y, limb.flexion)]
