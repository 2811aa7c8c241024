"""The simulated person seen by a ring of small cameras, for tests of the tracker."""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.evidence.evidence import Evidence, evidence_of
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.hull.contour_rays import extract_outlines
from zenocap.services.tracker.initialization.localization import detect_t_pose
from zenocap.services.tracker.initialization.t_pose import TPoseFit, fit_t_poses
from zenocap.services.tracker.parameters import T_POSE_HOLD
from zenocap.services.tracker.states import Options, Outcome, TrackerSetup, TrackState
from zenocap.services.tracker.tracking import describe, initial_state, track
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement, neutral, place
from zenocap.simulation.body.skeleton import Bones
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import motion_timeline, t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE = (240, 180)
FRAME_NS = 1_000_000_000 // 30
MIDDLE = np.array([0.0, 1.0, 0.0])


@lru_cache
def ring(count: int, size: tuple[int, int] = SIZE) -> dict[str, Camera]:
    """Cameras "1", "2" ... in a ring, 1.2 to 2 m high and 5 m away; two of them are at a right angle."""
    turns = [0.0, -np.pi / 2] if count == 2 else 2 * np.pi * np.arange(count) / count
    heights = 1.2 + 0.8 * (np.arange(count) % 2)
    return {
        str(k): look(f"cam{k}", np.array([5.0 * np.sin(turn), height, 5.0 * np.cos(turn)]), MIDDLE).resized(size)
        for k, (turn, height) in enumerate(zip(turns, heights, strict=True), start=1)
    }


def setup(cameras: Mapping[str, Camera], person_height: float | None = None, seed: int = 0) -> TrackerSetup:
    options = Options(particles=6, points=300, seed=seed)
    return TrackerSetup(FOURTEEN_PARTS, cameras, FRAME_NS, None, options, person_height)


@lru_cache
def simulated_person(seed: int) -> Person:
    return person(seed)


def t_pose_at(seed: int, x: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> PersonPose:
    """T-pose, metres and radians."""
    return place(t_pose(simulated_person(seed)), Placement(x, z, yaw))


def standing_at(seed: int, x: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> PersonPose:
    """Arms down, metres and radians."""
    return place(neutral(simulated_person(seed)), Placement(x, z, yaw))


def in_motion(seed: int, count: int, kind: str = "walking", from_s: float = 0.0) -> list[PersonPose]:
    """Poses of a motion, 30 a second, from some time after its start."""
    timeline = motion_timeline(simulated_person(seed), kind, 0)
    return [timeline.pose_at(timeline.motion_from_s + from_s + k / 30) for k in range(count)]


def hip_error(seed: int, position: Floats | tuple[float, float, float], pose: PersonPose | Bones) -> float:
    """Distance of a position to the true hips, metres."""
    return float(np.linalg.norm(np.array(position) - truth(simulated_person(seed), pose).joints["Hip"]))


def ahead(yaw: float) -> Floats:
    """(3,) the direction of a heading."""
    return np.array([np.sin(yaw), 0.0, np.cos(yaw)])


def rendered_masks(cameras: Mapping[str, Camera], seed: int, pose: PersonPose | Bones | None) -> dict[str, Mask]:
    """Masks by viewer, (height, width); empty ones without a pose."""
    if pose is None:
        return {viewer: np.zeros(camera.size[::-1], np.uint8) for viewer, camera in cameras.items()}
    return {viewer: _simulated_camera(camera, seed).silhouette(pose) for viewer, camera in cameras.items()}


def seen(cameras: Mapping[str, Camera], masks: Sequence[Mask | None], points: int = 300) -> Evidence:
    """Evidence of the masks."""
    contours, silhouettes = extract_outlines(masks, list(cameras.values()), points)
    return evidence_of(contours, silhouettes)[0]


def shown(cameras: Mapping[str, Camera], seed: int, pose: PersonPose | Bones | None) -> Evidence:
    """Evidence of the person in a pose; of an empty scene without one."""
    return seen(cameras, list(rendered_masks(cameras, seed, pose).values()))


def fit_of(setup: TrackerSetup, evidence: Evidence) -> TPoseFit | str:
    """The T-pose in the evidence of one frame set."""
    weights = residual_weights(setup, T_POSE_HOLD)
    return fit_t_poses(setup.anatomy, [evidence], [detect_t_pose(evidence.rays)], weights)


def played(
    setup: TrackerSetup, seed: int, poses: Iterable[PersonPose | Bones | None], state: TrackState | None = None,
    start: int = 0,
) -> tuple[TrackState, list[Outcome], list[str]]:  # fmt: skip
    """Final state, outcomes and health texts of tracking a simulated person, in frame sets from number `start` on."""
    state = initial_state(setup) if state is None else state
    outcomes, texts = [], []
    for k, pose in enumerate(poses, start):
        state, outcome = track(setup, state, k * FRAME_NS, rendered_masks(setup.cameras, seed, pose))
        outcomes.append(outcome)
        texts.append(describe(state))
    return state, outcomes, texts


_SIMULATED_CAMERAS: dict[tuple[int, int], SimulatedCamera] = {}


def _simulated_camera(camera: Camera, seed: int) -> SimulatedCamera:
    key = (id(camera), seed)
    if key not in _SIMULATED_CAMERAS:
        _SIMULATED_CAMERAS[key] = SimulatedCamera(camera, simulated_person(seed), 0)
    return _SIMULATED_CAMERAS[key]
