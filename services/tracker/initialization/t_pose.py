"""Initialization from the T-pose: the body measured over several frame sets."""

# Paper (open): [Hybrid] does not say how the track starts and the body is measured.

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.proportions import HIP_HEIGHT, t_pose_angles
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.body.sizes import COUNT
from zenocap.services.tracker.filter.correspondence import distances_of, misfit, support_fraction
from zenocap.services.tracker.filter.filter_step import no_pose, start_tracking
from zenocap.services.tracker.hull.contour_rays import midpoints
from zenocap.services.tracker.hull.silhouette_distance import DistanceField
from zenocap.services.tracker.initialization.body_fitting import BodyFit, FitSample, fit_body
from zenocap.services.tracker.initialization.localization import (
    TPose,
    detect_t_pose,
    rays_near,
)
from zenocap.services.tracker.initialization.online_shape import initial_shape, updated_shape
from zenocap.services.tracker.parameters import (
    CLUTTER_DISTANCE_M,
    CLUTTER_TRUST_POWER,
    FIT_INDEPENDENT_RAYS,
    FIT_ITERATIONS,
    FIT_RESIDUAL_LIMIT_M,
    FOOT_HEIGHT,
    GOOD_GAP_M,
    HEADING_MISFIT_RATIO,
    MAX_GAP_M,
    POSTURE_INDEPENDENT_RAYS,
    RETRY_FRAMES,
    SHANK_HEIGHT,
    T_POSE_DEVIATION,
    T_POSE_FRAMES,
    T_POSE_MAX_DEG,
    T_POSE_STILL_COSINE,
    T_POSE_STILL_M,
)
from zenocap.services.tracker.states import AwaitingPerson, Outcome, Person, Setup, Tracking

T_POSE_MAX_ANGLE = np.radians(T_POSE_MAX_DEG)  # rad: of a shoulder or elbow from the T-pose


@dataclass(frozen=True)
class TPoseFit:
    """Result of the body fit.

    heading_known: False when the opposite heading fits about as well.  reliability: reliability of the scenes, in (0, 1].
    """

    measured: BodyFit
    heading_known: bool
    reliability: float


def fit_t_poses(
    anatomy: Anatomy, scenes: Sequence[Floats32], fields: Sequence[DistanceField], t_poses: Sequence[TPose]
) -> TPoseFit | str:
    """Body from rays (11, n) and distance fields of several scenes of the T-pose, or a text with the reason of failure.

    Both headings perpendicular to the arms are fitted; feet and belly show which one is right.
    """
    held = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), t_pose_angles(anatomy)))
    stature = float(np.median([one.stature for one in t_poses]))
    average = average_body(anatomy, stature)
    near_rays = [rays_near(rays, one) for rays, one in zip(scenes, t_poses, strict=True)]
    found = []
    for side in (1.0, -1.0):
        samples = []
        for rays, one in zip(near_rays, t_poses, strict=True):
            across = side * one.across * np.sign(one.across @ t_poses[0].across)
            left, up = np.array([across[0], 0.0, across[1]]), np.array([0.0, 1.0, 0.0])
            rotation = np.stack([left, up, np.cross(left, up)], axis=1)
            position = np.array([one.centre[0], one.low + HIP_HEIGHT * stature, one.centre[1]])
            samples.append(FitSample(rays, RootedPose(position, rotation, held.copy()), held, T_POSE_DEVIATION))
        measured, reliability = fit_body(anatomy, average, samples, np.zeros(COUNT), FIT_ITERATIONS), 1.0
        if measured.gap > GOOD_GAP_M:
            reliability = (GOOD_GAP_M / measured.gap) ** CLUTTER_TRUST_POWER
            measured = _fit_without_clutter(anatomy, average, measured, samples, reliability)
        found.append((_mean_misfit(anatomy, measured, near_rays, fields), measured, reliability))
    (error, best, reliability), (other, _, _) = sorted(found, key=lambda one: one[0])
    if "right_foot" not in anatomy.parts:  # such a body looks the same from the front and from behind
        forward = sum(
            _toe_offset(midpoints(rays), one, t_poses[0].across) for rays, one in zip(near_rays, t_poses, strict=True)
        )
        _, best, reliability = found[0] if forward > 0.0 else found[1]
    if not best.gap <= MAX_GAP_M:
        return f"no body fits: gaps of {best.gap * 1000:.0f} mm (at most {MAX_GAP_M * 1000:.0f}); stand still in every view"
    away = max(float(np.abs(pose.values - held).max()) for pose in best.poses)
    if away > T_POSE_MAX_ANGLE:
        return f"hold both arms straight out; a joint is {np.degrees(away):.0f} degrees off"
    return TPoseFit(best, error < HEADING_MISFIT_RATIO * other, reliability)


def _toe_offset(points: Floats, one: TPose, across: Floats) -> float:
    """Metres by which feet reach forward of shanks in points (n, 3), for a person with `across` (2,) to the left."""
    height = (points[:, 1] - one.low) / one.stature
    depth = points[:, [0, 2]] @ np.array([-across[1], across[0]])
    feet, shanks = depth[height < FOOT_HEIGHT], depth[(height > SHANK_HEIGHT[0]) & (height < SHANK_HEIGHT[1])]
    if not len(feet) or not len(shanks):
        return 0.0
    middles = [0.5 * float(np.sum(np.percentile(part, [5, 95]))) for part in (feet, shanks)]
    return middles[0] - middles[1]


def _mean_misfit(anatomy: Anatomy, measured: BodyFit, scenes: Sequence[Floats32], fields: Sequence[DistanceField]) -> float:
    """Mean misfit of the poses in m^2."""
    model = model_of(anatomy, measured.body)
    return float(
        np.mean(
            [
                misfit(model, rays, field, FIT_RESIDUAL_LIMIT_M, pose)
                for rays, field, pose in zip(scenes, fields, measured.poses, strict=True)
            ]
        )
    )


def _fit_without_clutter(
    anatomy: Anatomy, average: Bdp, first: BodyFit, samples: Sequence[FitSample], reliability: float
) -> BodyFit:
    """Fit again without rays far from the body, weighted by the reliability of the others."""
    model = model_of(anatomy, first.body)
    again = []
    for sample, pose in zip(samples, first.poses, strict=True):
        near = distances_of(model, sample.rays, pose) < CLUTTER_DISTANCE_M
        again.append(replace(sample, rays=np.ascontiguousarray(sample.rays[:, near]), pose=pose))
    return fit_body(anatomy, average, again, np.zeros(COUNT), FIT_ITERATIONS, reliability * FIT_INDEPENDENT_RAYS)


def await_person(
    setup: Setup, phase: AwaitingPerson, captured_ns: int, rays: Floats32, field: DistanceField
) -> tuple[AwaitingPerson | Tracking, Outcome]:
    """Collect T_POSE_FRAMES frame sets of the T-pose, then fit the body and start tracking."""
    no_result = no_pose(setup, lost=False)
    if phase.rest:
        return replace(phase, rest=phase.rest - 1), no_result
    t_pose = detect_t_pose(rays)
    if isinstance(t_pose, str):
        return AwaitingPerson(t_pose), no_result
    if phase.t_poses and not _is_still(phase.t_poses[-1], t_pose):
        phase = AwaitingPerson()
    scenes, fields, t_poses = (*phase.scenes, rays), (*phase.fields, field), (*phase.t_poses, t_pose)
    if len(scenes) < T_POSE_FRAMES:
        return AwaitingPerson(f"measuring the body ({len(scenes)} of {T_POSE_FRAMES})", scenes, fields, t_poses), no_result
    found = fit_t_poses(setup.anatomy, scenes, fields, t_poses)
    if isinstance(found, str):
        return AwaitingPerson(found, rest=RETRY_FRAMES), no_result
    measured = found.measured
    stature = float(np.median([one.stature for one in t_poses]))
    shape = initial_shape(average_body(setup.anatomy, stature), measured.logs)
    for scene_rays, pose in zip(scenes, measured.poses, strict=True):
        shape = updated_shape(setup.anatomy, shape, scene_rays, pose, found.reliability * POSTURE_INDEPENDENT_RAYS)
    model = model_of(setup.anatomy, measured.body)
    expected_support = support_fraction(model, rays_near(rays, t_pose), measured.poses[-1])
    person = Person(measured.body, model, stature, shape, expected_support, found.heading_known)
    tracking, outcome = start_tracking(setup, person, measured.poses[-1], captured_ns, measured.gap**2)
    return tracking, replace(outcome, body=measured.body)


def _is_still(before: TPose, now: TPose) -> bool:
    """True when a T-pose has hardly moved or turned since the previous one."""
    moved = float(np.linalg.norm(now.centre - before.centre))
    return moved < T_POSE_STILL_M and abs(float(now.across @ before.across)) > T_POSE_STILL_COSINE
