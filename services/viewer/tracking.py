"""A viewer's tracking of one frame: a sighting first, and the limbs once the integrator has placed the body."""

from dataclasses import replace

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.limbs import LIMBS, Limb, limb_angles, limb_directions, limbs_of, resting_arm
from common.body.torso import torso_rotation, width_thresholds
from common.conversion import angles_by_name
from common.messages import Assignment, LimbMatch, Message, PartialBap, Sighting
from services.viewer.arms import find_arm
from services.viewer.body_fit import BodyFit, Mask, around
from services.viewer.hypotheses import arm_ways, chosen, leg_ways, way_scores
from services.viewer.legs import LEFT, RIGHT, exchange_gain, find_leg_facade, find_leg_flank
from services.viewer.limb_fit import LimbResult
from services.viewer.measuring import outline
from services.viewer.position import Sight, sight
from services.viewer.states import Pending, Setup, Tracking
from services.viewer.view import own_view, toes_offset, upper_body_width

PREDICTED = 1.0  # share of the last frame's motion that is expected to go on
FASTEST = 0.7  # cosine of a limb's turn in one frame beyond which it was found elsewhere and did not move
# PREDICTED, LEG_DRAW and LOST_SHARE were tried out on the shared clips walk2, bend2 and kick2: no independent test of them.
LEG_DRAW = 0.03  # as DRAW, for legs
DRAW = 0.01  # matching score that a limb's motion may cost, see LimbBody.expected
REST_DRAW = 0.005  # the same towards the hanging arm
LOST_PERSON, LOST_SHARE = 0.5, 0.92  # of the person's own typical score in this view: look elsewhere, look wider
RISE, FALL = 0.2, 0.01  # the typical score follows the good ones


def torso_of(setup: Setup, angles: Floats) -> Floats:
    """(3, 3) torso to world of a pose's angles."""
    index = setup.anatomy.index
    return torso_rotation(*(float(angles[index[f"navel.{axis}"]]) for axis in "yxz"))


def sighting(setup: Setup, state: Tracking, pending: Pending) -> tuple[Tracking, Sighting]:
    """Position, tilt and turn of the body in this view, from where the universal BAP had it.  [Two-view 3.1, 3.2]"""
    pose = state.pose
    torso = torso_of(setup, pose.angles)
    directions = limb_directions(setup.anatomy, pose.angles)
    fit = BodyFit(state.model, *around(setup.rows, pending.mask), pending.mask.shape[0])
    start = pose.position + PREDICTED * (pose.position - state.before.position)
    found = sight(fit, start, torso, directions)
    if state.typical and found.score < LOST_PERSON * state.typical:
        found = _found_again(setup, state, pending.mask, fit, torso, directions, found.score) or found
    local = setup.rows[:3] @ found.position + setup.rows[3]
    shape = outline(pending.mask)
    focal, (_, cy) = setup.level.focal_px(), setup.level.centre_px()
    torso_px = float(state.model.torso[0]) * focal / local[2]
    width = upper_body_width(pending.mask, cy + focal * local[1] / local[2], torso_px)
    metres = width * local[2] / focal
    low, high = width_thresholds(2 * float(state.model.torso[2]), 2 * float(state.model.torso[1]))
    before = state.assignment.views[setup.id].view if state.assignment else "facade"
    expected = _expected(setup, state, torso)
    arms = way_scores(fit, 0, arm_ways(expected, resting_arm(torso, float(pose.angles[setup.anatomy.index["navel.y"]]))))
    legs = way_scores(fit, RIGHT, leg_ways(expected))
    toes = float(np.clip(toes_offset(pending.mask) * local[2] / focal, -1, 1))
    message = Sighting(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, present=True,
        x=float(local[0] / local[2]), y=float(local[1] / local[2]), height=shape.height / focal, width=width / focal,
        view=own_view(before, metres, low, high), score=found.score, tilt=found.tilt, turns=list(found.turns),
        toes=toes, arms=arms.tolist(), legs=legs.tolist(), based_on=state.based_on,
    )  # fmt: skip
    pending = replace(pending, fit=fit)
    return replace(state, pending=pending, score=found.score), message


def _found_again(
    setup: Setup, state: Tracking, mask: Mask, fit: BodyFit, torso: Floats, directions: Floats, score: float
) -> Sight | None:
    """The person where the silhouette's torso is, when the last place explains it badly."""
    shape = outline(mask)
    focal, (cx, cy) = setup.level.focal_px(), setup.level.centre_px()
    depth = float(setup.rows[2] @ state.pose.position + setup.rows[3, 2])
    local = np.array([(shape.column - cx) / focal, (shape.navel_row - cy) / focal, 1.0]) * depth
    place = setup.rows[:3].T @ (local - setup.rows[3])
    found = sight(fit, place, torso, directions)
    return found if found.score > score else None


def limbs(setup: Setup, state: Tracking, pending: Pending, assignment: Assignment) -> tuple[Tracking, list[Message]]:
    """Partial BAP of the pending frame with the body where the integrator placed it.  [Two-view 3.3, 3.4]"""
    anatomy, fit = setup.anatomy, pending.fit
    if fit is None:
        return replace(state, pending=None), []
    torso = torso_rotation(assignment.yaw, assignment.lean, assignment.roll)
    position = np.array(assignment.position)
    expected = _expected(setup, state, torso)
    resting = resting_arm(torso, assignment.yaw)
    if assignment.arms:
        expected[:2] = chosen(arm_ways(expected, resting), assignment.arms)
    if assignment.legs:
        expected[2:] = chosen(leg_ways(expected), assignment.legs)
    fit.expected = DRAW * expected
    fit.expected[:2] += REST_DRAW * resting
    fit.expected[2:] *= LEG_DRAW / DRAW
    fit.place(position, torso, expected)
    view = assignment.views[setup.id].view
    standing = np.tile(torso.T @ np.array([0.0, -1.0, 0.0]), (2, 1))
    results: dict[int, LimbResult] = {}

    def search(lost: bool) -> None:
        for k in (RIGHT, LEFT):
            if view == "facade":
                results[k] = find_leg_facade(fit, k, assignment.squatting)
            else:
                results[k] = find_leg_flank(fit, k, standing, lost)
        for k in (0, 1):
            results[k] = find_arm(fit, k, resting, lost)

    search(lost=False)
    lost = fit.score() < LOST_SHARE * state.typical
    if lost:
        search(lost=True)
    score = fit.score()
    typical = state.typical + (RISE if score > state.typical else FALL) * (score - state.typical)
    gain = exchange_gain(fit) if view == "facade" else 0.0
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
    return replace(state, pending=None, assignment=assignment, typical=typical, lost=lost), [message]


def _expected(setup: Setup, state: Tracking, torso: Floats) -> Floats:
    """(4, 2, 3) where the limbs should be in the frame of `torso` (3, 3) if their last motion goes on."""
    anatomy = setup.anatomy
    directions = limb_directions(anatomy, state.pose.angles) @ torso_of(setup, state.pose.angles).T @ torso
    before = limb_directions(anatomy, state.before.angles) @ torso_of(setup, state.before.angles).T @ torso
    moving = np.sum(directions * before, axis=2, keepdims=True) > FASTEST
    expected: Floats = directions + PREDICTED * np.where(moving, directions - before, 0.0)
    expected /= np.linalg.norm(expected, axis=2, keepdims=True)
    return expected


def _angle_names(anatomy: Anatomy, limb: Limb) -> list[str]:
    return [anatomy.angles[k] for k in (limb.z, limb.x, limb.y, limb.flexion)]
