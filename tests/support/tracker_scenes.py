"""Scenes of a body of known pose: rays tangent to its surface, without rendering.

`touch` is the plain oracle of the compiled `contact_on_part`.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of, model_of
from zenocap.services.tracker.body.jacobian import ROOT
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.evidence.field import no_distance_field
from zenocap.services.tracker.evidence.rays import CONTACT_LENGTH, contact_on_part
from zenocap.services.tracker.hull.contour_rays import ContourRays
from zenocap.services.tracker.parameters import CONTACT_SHIFT_M

STATURE_M = 1.75
CAMERAS = 6
CAP = 0.7  # share of a free part's axis beyond which rays go around its end
DEPTH_M = 0.4  # of a surviving interval, before and behind the tangent point
NO_RAYS = np.zeros((11, 0), np.float32)


def average_model(anatomy: Anatomy) -> BodyModel:
    return model_of(anatomy, average_body(anatomy, STATURE_M))


MODEL = average_model(FOURTEEN_PARTS)
PARTS = len(MODEL.parent)
DOF = ROOT + len(MODEL.low)


@dataclass(frozen=True)
class Touch:
    """distance, gap: metres.  point: (3,) on the surface.  share: fraction of the axis.

    shrinks: (3,) see `contact_on_part`.
    """

    distance: float
    gap: float
    point: Floats
    share: float
    shrinks: Floats


def turn(vector: Floats) -> Floats:
    rotation = np.empty((3, 3))
    vector_to_matrix(np.asarray(vector, dtype=np.float64), rotation)
    return rotation


def touch(model: BodyModel, frame: Floats, part: int, ray: Floats) -> Touch:
    """Contact of a ray (11,) with a part whose frame is (3, 4), by the definition of `contact_on_part`."""
    origin, direction, normal, near, far = ray[0:3], ray[3:6], ray[6:9], ray[9], ray[10]
    rotation, length = frame[:, :3], model.lengths[part]
    base = frame[:, 3] + rotation @ model.bases[part]
    axis = rotation[:, 1]
    slope, start = direction @ axis, base - origin
    s = np.clip((slope * (direction @ start) - axis @ start) / (1 - slope**2 + 1e-9), 0, length)
    t = np.clip(direction @ (start + s * axis), near, far)
    met = np.clip(axis @ (t * direction - start), 0, length)
    s = np.clip(met + CONTACT_SHIFT_M * (normal @ axis), 0, length)
    share = s / length
    wide, deep = model.radii[part, :2] + share * (model.radii[part, 2:] - model.radii[part, :2])
    radii = np.array([wide, (wide + deep) / 2, deep])
    local = rotation.T @ normal
    support = np.linalg.norm(radii * local) + 1e-9
    point = base + s * axis + rotation @ (radii**2 * local / support)
    t = np.clip(direction @ (point - origin), near, far)
    off = origin + t * direction - point
    gap = float(normal @ off)
    along = (s - met) ** 2 * (1 - (normal @ axis) ** 2)
    distance = float(np.sqrt(off @ off - min(off @ off - gap**2, along)))
    slip = 0.0
    if 0 < s < length:
        wider = model.radii[part, 2:] - model.radii[part, :2]
        slip = local[1] + (wide * local[0] ** 2 * wider[0] + deep * local[2] ** 2 * wider[1]) / (support * length)
    return Touch(distance, gap, point, float(share), normal - slip * axis)


def upright(anatomy: Anatomy = FOURTEEN_PARTS, seed: int = 0, spread: float = 0.4) -> RootedPose:
    """Random position and heading, limbs a little off the middle of their ranges."""
    rng = np.random.default_rng(seed)
    coordinates = coordinates_of(anatomy)
    values = rng.normal(scale=spread / 2, size=coordinates.dimension)
    for name, middle in (("elbow", 0.6), ("knee", -0.6), ("ankle", 1.5)):
        for k, coordinate in enumerate(coordinates.names):
            values[k] += middle if name in coordinate else 0.0
    rotation = turn(np.array([0.05, rng.uniform(-3, 3), -0.03]))
    return RootedPose(np.array([rng.uniform(-0.5, 0.5), 0.95, rng.uniform(-0.5, 0.5)]), rotation, values)


def in_t_pose(anatomy: Anatomy, position: Floats, yaw: float = 0.0) -> RootedPose:
    values = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), t_pose_angles(anatomy)))
    return RootedPose(np.asarray(position, dtype=np.float64), turn(np.array([0.0, yaw, 0.0])), values)


def moved(pose: RootedPose, rng: np.random.Generator, metres: float, radians: float) -> RootedPose:
    """A pose nearby: standard deviations of position, and of orientation and coordinates."""
    return RootedPose(
        pose.position + rng.normal(scale=metres, size=3),
        turn(rng.normal(scale=radians, size=3)) @ pose.rotation,
        pose.values + rng.normal(scale=radians, size=len(pose.values)),
    )


def tangent_rays(model: BodyModel, pose: RootedPose, count: int, seed: int = 0, parts: tuple[int, ...] = ()) -> Floats32:
    """(11, count) rays of cameras on a ring that touch the body's parts (all, without `parts`) with zero gap."""
    rng = np.random.default_rng(seed)
    frames = frames_of(model, pose)
    chosen = parts or tuple(range(len(model.parent)))
    rows = []
    for k in range(count):
        part, camera = chosen[k % len(chosen)], int(rng.integers(CAMERAS))
        angle = 2 * np.pi * camera / CAMERAS + 0.3
        centre = np.array([4 * np.sin(angle), 1.2 + 0.3 * (camera % 3), 4 * np.cos(angle)])
        rows.append(
            _tangent(model, frames[part], part, centre, rng.uniform(0.02, 0.98), float(rng.choice([-1.0, 1.0])), camera)
        )
    columns = np.array(rows).T
    return ContourRays(
        columns[11].astype(np.int64), *(columns[k : k + 3].T for k in (0, 3, 6)), columns[9], columns[10]
    ).rows


def contact_of(model: BodyModel, frame: Floats, part: int, rays: Floats32, ray: int = 0) -> Floats:
    """(CONTACT_LENGTH,) by the compiled function."""
    found = np.empty(CONTACT_LENGTH)
    contact_on_part(model, frame, part, rays, ray, found)
    return found


def rays_alone(rays: Floats32) -> Evidence:
    """Evidence without silhouettes."""
    return Evidence(rays, no_distance_field())


def _tangent(
    model: BodyModel, frame: Floats, part: int, centre: Floats, share: float, side: float, camera: int
) -> list[float]:
    """Ray from `centre` (3,) past one side of a part near a fraction of its axis, with zero gap."""
    rotation = frame[:, :3]
    point = frame[:, 3] + rotation @ (model.bases[part] + np.array([0.0, share * model.lengths[part], 0.0]))
    normal = side * np.cross(rotation[:, 1], point - centre)
    if model.free[part] and share > CAP:  # around the round end
        normal += 6.0 * (share - CAP) / (1 - CAP) * np.linalg.norm(normal) * rotation[:, 1]
    ray = np.empty(11)
    for _ in range(8):
        away = float(np.linalg.norm(point - centre))
        direction = (point - centre) / away
        normal = normal - (normal @ direction) * direction
        normal /= np.linalg.norm(normal)
        ray[:] = [*centre, *direction, *normal, away - DEPTH_M, away + DEPTH_M]
        point = point - touch(model, frame, part, ray).gap * normal
    return [*ray.tolist(), float(camera)]


def apart(model: BodyModel, one: RootedPose, other: RootedPose) -> Floats:
    """(2 p,) distances of both ends of every part's axis, metres: the error of a pose."""
    return np.linalg.norm(_ends(model, one) - _ends(model, other), axis=1)


def carried_by(model: BodyModel, part: int) -> list[int]:
    """A part and those that carry it, up to the root."""
    return [part, *carried_by(model, int(model.parent[part]))] if part >= 0 else []


def _ends(model: BodyModel, pose: RootedPose) -> Floats:
    """(2 p, 3) metres."""
    frames = frames_of(model, pose)
    base = frames[:, :, 3] + np.einsum("pij,pj->pi", frames[:, :, :3], model.bases)
    return np.concatenate([base, base + model.lengths[:, None] * frames[:, :, 1]])
