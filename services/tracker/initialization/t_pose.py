"""Initialization from the T-pose: the body measured over several frame sets."""

# Paper (open): [Hybrid] does not define how the track starts and the body is measured.

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.proportions import HIP_HEIGHT, t_pose_angles
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, frames_of, model_of
from zenocap.services.tracker.body.sizes import SIZE_NAMES, SPREADS
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.evidence.rays import distances_of
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.filter_step import no_pose, residual_weights, start_tracking
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.initialization.body_fitting import FitSample, FittedBody, fit_body
from zenocap.services.tracker.initialization.heading import foot_reach
from zenocap.services.tracker.initialization.localization import Column, TPose, detect_t_pose, rays_in_column
from zenocap.services.tracker.initialization.online_shape import initial_shape, updated_shape
from zenocap.services.tracker.states import (
    LEG_KINDS,
    AwaitingPerson,
    Outcome,
    TrackedPerson,
    TrackerSetup,
    Tracking,
    refuted,
)

# A fit starts with short arms: rays at the end of an arm pull a shorter one out, but a longer one is not pushed back.
SHORT_ARMS = np.array([-p.START_SHORT * SPREADS[k] if name == "arm" else 0.0 for k, name in enumerate(SIZE_NAMES)])
T_POSE_MAX_ANGLE = np.radians(p.T_POSE_MAX_DEG)  # rad


@dataclass(frozen=True)
class TPoseFit:
    """Result of the body fit, with the front on one side.

    poses: of the scenes, with this body.  toes: forward reach of the feet, metres.  reliability: of the scenes, in (0, 1].
    heading_known: False when the feet do not show which side is the front.
    """

    measured: FittedBody
    poses: tuple[RootedPose, ...]
    toes: float
    reliability: float
    heading_known: bool = True


def fit_t_poses(
    anatomy: Anatomy,
    seen: Sequence[Evidence],
    t_poses: Sequence[TPose],
    weights: Weights,
    detail: float = 1.0,
    front: Floats | None = None,
) -> TPoseFit | str:
    """Body from the evidence of several frame sets of the T-pose, or a text with the reason of failure.

    weights: of the residuals, with the target T_POSE_HOLD.  detail: see `TrackedPerson`.  front: (3,) along which the
    person faces rather than away from it, where that is known.

    An average body in every heading shows the direction of the arms.  Each of two views has the arms in two places of the
    visual hull, and only perspective tells them apart.  Both headings perpendicular to the arms are then fitted, and the
    feet show which one is the front where it is not known.
    """
    held = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), t_pose_angles(anatomy)))
    stature = float(np.median([one.stature for one in t_poses]))
    near = [evidence_near(one, t_pose) for one, t_pose in zip(seen, t_poses, strict=True)]
    sides = _starts(anatomy, near, t_poses, stature, weights)
    found = [_fit(anatomy, near, t_poses, stature, starts, weights, detail) for starts in sides]
    best = max(found, key=lambda one: one.toes if front is None else float(one.poses[-1].rotation[:, 2] @ front))
    gap, most = best.measured.gap, max(p.MAX_GAP_M, p.FIT_RESIDUAL_SCALE_M / np.sqrt(detail))  # a pixel's size
    if not gap <= most:
        return f"no body fits: gaps of {gap * 1000:.0f} mm (at most {most * 1000:.0f}); stand still in every view"
    away = np.array([_deviations(anatomy, best.measured.body, pose, held) for pose in best.poses])
    if np.median(np.sqrt(np.mean(away**2, axis=1))) > T_POSE_MAX_ANGLE:
        return f"hold both arms straight out, legs straight; a limb is {np.degrees(away.max()):.0f} degrees off"
    return replace(best, heading_known=front is not None or best.toes > p.HEADING_TOES * stature)


def evidence_near(evidence: Evidence, at: TPose) -> Evidence:
    """The evidence with the rays within the person's reach; silhouettes of others remain."""
    column = Column(at.centre, at.low, at.low + at.stature)
    return evidence._replace(rays=rays_in_column(evidence.rays, column, p.PERSON_RADIUS * at.stature))


def _starts(
    anatomy: Anatomy, seen: Sequence[Evidence], t_poses: Sequence[TPose], stature: float, weights: Weights
) -> tuple[list[RootedPose], list[RootedPose]]:
    """T-poses of an average body in every scene, in the best direction of the arms, facing to either side."""
    model, half = model_of(anatomy, average_body(anatomy, stature)), p.T_POSE_HEADINGS // 2
    held = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), t_pose_angles(anatomy)))
    errors, poses = np.zeros(p.T_POSE_HEADINGS), []
    for evidence, one in zip(seen, t_poses, strict=True):
        position = np.array([one.centre[0], one.low + HIP_HEIGHT * stature, one.centre[1]])
        tried = []
        for k in range(p.T_POSE_HEADINGS):
            yaw = 2.0 * np.pi * k / p.T_POSE_HEADINGS
            start = _upright(position, np.sin(yaw), np.cos(yaw), held)
            pose = start.copy()
            refine(model, evidence, weights, p.T_POSE_ITERATIONS, pose, start)
            errors[k] += float(misfit(model, evidence, p.FIT_RESIDUAL_LIMIT_M, pose))
            tried.append(pose)
        poses.append(tried)
    best = int(np.argmin(np.minimum(errors[:half], errors[half:])))
    first, second = (
        [_upright(tried[k].position, tried[k].rotation[0, 2], tried[k].rotation[2, 2], held) for tried in poses]
        for k in (best, best + half)
    )
    return first, second


def _upright(position: Floats, x: float, z: float, values: Floats) -> RootedPose:
    """Upright pose that faces along (x, z)."""
    forward, up = np.array([x, 0.0, z]) / np.hypot(x, z), np.array([0.0, 1.0, 0.0])
    return RootedPose(position.copy(), np.stack([np.cross(up, forward), up, forward], axis=1), values.copy())


def _fit(
    anatomy: Anatomy, seen: Sequence[Evidence], t_poses: Sequence[TPose], stature: float, starts: Sequence[RootedPose],
    weights: Weights, detail: float,
) -> TPoseFit:  # fmt: skip
    """Body fitted from the starts; then its poses, with the silhouettes, which show the empty space."""
    average = average_body(anatomy, stature)
    samples = [
        FitSample(one.rays, start, start.values, p.T_POSE_DEVIATION) for one, start in zip(seen, starts, strict=True)
    ]
    independent, reliability = detail * p.FIT_INDEPENDENT_RAYS, detail
    measured = fit_body(anatomy, average, samples, SHORT_ARMS, p.FIT_ITERATIONS, independent)
    if measured.gap > p.GOOD_GAP_M:
        reliability = detail * (p.GOOD_GAP_M / measured.gap) ** p.CLUTTER_TRUST_POWER
        samples = _without_clutter(anatomy, measured, samples)
        independent = reliability * p.FIT_INDEPENDENT_RAYS
        measured = fit_body(anatomy, average, samples, SHORT_ARMS, p.FIT_ITERATIONS, independent)
    model, poses, toes = model_of(anatomy, measured.body), [], []
    for sample, evidence, fitted, one in zip(samples, seen, measured.poses, t_poses, strict=True):
        trusted = evidence._replace(rays=sample.rays)
        pose = fitted.copy()
        for _ in range(p.T_POSE_PASSES):
            held = _upright(pose.position, pose.rotation[0, 2], pose.rotation[2, 2], sample.held)
            refine(model, trusted, weights, p.T_POSE_ITERATIONS, pose, held)
        poses.append(pose)
        toes.append(foot_reach(anatomy, model, sample.rays, pose, one.stature) or 0.0)
    return TPoseFit(measured, tuple(poses), float(np.mean(toes)), reliability)


def _deviations(anatomy: Anatomy, body: Bdp, pose: RootedPose, held: Floats) -> Floats:
    """Angles (parts,) in radians of the parts of arms and legs from their directions in the T-pose, seen from the root."""
    model = model_of(anatomy, body)
    limbs = [k for k, name in enumerate(anatomy.parts) if "arm" in name or "leg" in name]
    along, straight = (frames_of(model, one)[limbs, :, 1] for one in (pose, pose._replace(values=held)))
    angles: Floats = np.arccos(np.clip(np.sum(along * straight, axis=1), -1.0, 1.0))
    return angles


def _without_clutter(anatomy: Anatomy, first: FittedBody, samples: Sequence[FitSample]) -> list[FitSample]:
    """Samples without rays far from the body of a first fit, starting from its poses."""
    model = model_of(anatomy, first.body)
    left = []
    for sample, pose in zip(samples, first.poses, strict=True):
        near = distances_of(model, sample.rays, pose) < p.CLUTTER_DISTANCE_M
        left.append(replace(sample, rays=np.ascontiguousarray(sample.rays[:, near]), pose=pose))
    return left


def await_person(
    setup: TrackerSetup,
    phase: AwaitingPerson,
    captured_ns: int,
    evidence: Evidence,
    front: Callable[[Floats], Floats | None] = lambda place: None,
) -> tuple[AwaitingPerson | Tracking, Outcome]:
    """Collect T_POSE_FRAMES frame sets of the T-pose, then fit the body and start tracking.

    front: along which a person at a place (3,) faces, None where that is not known; see `fit_t_poses`.
    """
    no_result = no_pose(setup, lost=False)
    if phase.rest:
        return replace(phase, rest=phase.rest - 1), no_result
    fresh = replace(phase, seen=(), t_poses=())
    t_pose = detect_t_pose(evidence.rays)
    if isinstance(t_pose, str):
        return replace(fresh, advice=t_pose), no_result
    if phase.t_poses and not _is_still(phase.t_poses, t_pose):
        phase = fresh
    seen, t_poses = (*phase.seen, evidence), (*phase.t_poses, t_pose)
    if len(seen) < p.T_POSE_FRAMES:
        advice = f"measuring the body ({len(seen)} of {p.T_POSE_FRAMES})"
        return replace(fresh, advice=advice, seen=seen, t_poses=t_poses), no_result
    detail = detail_at(setup, t_pose.centre)
    facing = front(np.array([t_pose.centre[0], 0.0, t_pose.centre[1]]))
    weights = residual_weights(setup, p.T_POSE_HOLD)
    found = fit_t_poses(setup.anatomy, seen, t_poses, weights, detail, facing)
    if isinstance(found, str):
        return replace(fresh, advice=found, rest=p.T_POSE_RETRY_FRAMES), no_result
    measured = found.measured
    stature = float(np.median([one.stature for one in t_poses]))
    shape = initial_shape(average_body(setup.anatomy, stature), measured.logs)
    for one, pose in zip(seen, found.poses, strict=True):
        shape = updated_shape(setup.anatomy, shape, one.rays, pose, found.reliability * p.POSTURE_INDEPENDENT_RAYS)
    model = model_of(setup.anatomy, measured.body)
    expected_support = support_fraction(model, evidence_near(evidence, t_pose), found.poses[-1])
    person = TrackedPerson(measured.body, model, stature, shape, expected_support, found.heading_known, detail)
    tracking, outcome = start_tracking(setup, person, found.poses[-1], captured_ns, measured.gap**2)
    return replace(tracking, rivals=(*refuted(*LEG_KINDS), *tracking.rivals)), replace(outcome, body=measured.body)


def detail_at(setup: TrackerSetup, centre: Floats) -> float:
    """`TrackedPerson.detail` at a place (2,) on the ground, mean of all views."""
    found = []
    for camera in setup.cameras.values():
        away = float(np.linalg.norm(camera.centre[[0, 2]] - centre))
        found.append(min(1.0, (p.FIT_RESIDUAL_SCALE_M * camera.matrix[0, 0] / max(away, p.MIN_DEPTH_M)) ** 2))
    return float(np.mean(found))


def _is_still(before: Sequence[TPose], now: TPose) -> bool:
    """True when a T-pose has hardly moved or turned since the last one, nor become lower or higher since the first."""
    moved = float(np.linalg.norm(now.centre - before[-1].centre))
    turned = abs(float(now.across @ before[-1].across)) <= p.T_POSE_STILL_COSINE
    return max(moved, abs(now.stature - before[0].stature)) < p.T_POSE_STILL_M and not turned
