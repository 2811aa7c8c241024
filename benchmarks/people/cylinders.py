"""People who are the ten-part model: flat-ended cylinders drawn into seven views.  [Hybrid II, VI]

Their motion is that of motion capture files.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.harness.case import SHARED
from benchmarks.people.films import motion_file
from benchmarks.people.shared_clips import Instant
from benchmarks.people.simulated_clips import CYCLE_FPS, TRAINING_FRAMES, SimulatedClip, cameras_of
from benchmarks.people.tracker import NAMES
from tests.support.stored import stored
from zenocap.common.arrays import Bytes, Floats, Mask
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.coordinates import coordinates_of, unwrap_rotations
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import end_ellipses, joint_centres, part_frames
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.body.rotations import matrix_to_vector, vector_to_matrix
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.motion_files import read_poses_for
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.vision.model_image import ADD, cover_outline
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.prior.motions import motion_of
from zenocap.services.tracker.prior.training import TrainingPlan, train
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp

# Paper (replaced): [Hybrid VI] has people of HumanEva; here people who are the model.
MOTIONS = {"walking": "07_01", "jogging": "02_03", "boxing": "02_05"}  # files of `SHARED`
TEST_FRAMES = {"walking": 433, "jogging": 393, "boxing": 377}  # [Hybrid Table I]
REGIONS = 20  # [Hybrid VI]
# Paper (replaced): Fig. 4 and 8 of [Hybrid] end at M = 80; 40 and 80 regions need more than 100 training frames.
COUNTS = (5, 10, 20)
SIZE, VIEWS, CORNERS = (640, 480), 7, 64  # px; cameras; points of an ellipse, which is then exact to 0.1 % of its radius
T_POSE_S, LOWERING_S = 0.5, 1.5
FROM_S = 0.05  # of a file, whose first frame is often a rest pose
CIRCLE_M = 1.0  # radius of the way that is walked, about the middle of the room; chosen by hand
WALKS_MPS = 0.3  # slower, a person stands in the middle; chosen by hand
CYCLE_S = 0.5  # the shortest part of a file that is repeated


@dataclass(frozen=True)
class CylinderClip:
    """film: silhouettes and joint centres.  body: the person.  poses: by frame."""

    film: SimulatedClip
    body: Bdp
    poses: tuple[Pose, ...]


def cylinder_clip(motion: str, seed: int, tested: int | None = None) -> CylinderClip:
    """T-pose, then as many test frames of a motion as in the paper, by the person of a seed.  tested: their number."""
    count = TEST_FRAMES[motion] if tested is None else tested
    body, (_, performed) = true_bdp(person(seed)), _training_and_test(motion, seed)
    opening = _opening(body, performed[0])
    poses = (*opening, *performed[:count])
    return CylinderClip(_film(f"{motion}-{count}", seed, body, poses, len(opening)), body, poses)


def prior_of(motion: str, seed: int, test: bool = False, regions: int = REGIONS) -> Prior:
    """Prior of the first frames of a motion file, which are not filmed.  It has the errors of COUNTS.

    test: of as many of the first test frames instead.
    """
    poses, key = training_poses(motion, seed, test), "prior of test frames" if test else "prior"
    return stored(partial(_trained, motion, poses, regions), motion, seed, regions, key, sources=(__name__,))


def training_poses(motion: str, seed: int, test: bool) -> list[Pose]:
    """Poses of the frames of `prior_of`; a short half of a file repeats a part of itself."""
    training, tested = _training_and_test(motion, seed)
    return tested[:TRAINING_FRAMES] if test else training


@cache
def _training_and_test(motion: str, seed: int) -> tuple[list[Pose], list[Pose]]:
    body = true_bdp(person(seed))
    rows, velocity = captured_rows(SHARED / motion_file(MOTIONS[motion]), body)
    training = min(TRAINING_FRAMES, len(rows) // 2)
    parts = ((rows[:training], TRAINING_FRAMES), (rows[training:], TEST_FRAMES[motion]))
    before, after = (
        [_standing(body, _pose(body, row)) for row in _on_circle(_repeated(part, count), velocity)] for part, count in parts
    )
    return before, after


def captured_rows(path: Path, body: Bdp) -> tuple[Floats, Floats]:
    """Rows (n, 6 + d) of a body at CYCLE_FPS with a motion on the spot; velocity (2,) in x and z, m a frame."""
    found = read_poses_for(path, TEN_PARTS)
    times = np.arange(FROM_S, (len(found.poses) - 1) / found.rate, 1.0 / CYCLE_FPS)
    known = [one for k in np.rint(times * found.rate).astype(int) if (one := found.poses[k]) is not None]
    rows = _rows(body, known)
    time = np.arange(len(rows)) - (len(rows) - 1) / 2
    places = rows[:, [0, 2]]
    velocity: Floats = time @ places / (time @ time)
    rows[:, [0, 2]] = places - places.mean(axis=0) - time[:, None] * velocity
    return rows, velocity


def _repeated(rows: Floats, count: int) -> Floats:
    """(count, n) rows.  Too few are repeated: the part between two alike rows, over which their difference is spread."""
    return (rows if len(rows) >= count else _cycle(rows, count))[:count]


def _on_circle(rows: Floats, velocity: Floats) -> Floats:
    """The rows on a circle about the origin with the speed of a velocity (2,), m a frame, which is that of the first row.

    The people of the paper walk and jog round their room.  One who stands, such as a boxer, stays at the origin.
    """
    speed = float(np.linalg.norm(velocity))
    if speed * CYCLE_FPS < WALKS_MPS:
        return rows
    ahead = velocity / max(speed, 1e-9)
    from_centre = CIRCLE_M * np.array([-ahead[1], 0.0, ahead[0]])  # the way turns about +Y, which is to the left
    found, turn, own, step = rows.copy(), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k, row in enumerate(rows):
        vector_to_matrix(np.array([0.0, k * speed / CIRCLE_M, 0.0]), turn)
        vector_to_matrix(row[3:6], own)
        matrix_to_vector(turn @ own, step)
        found[k, :3], found[k, 3:6] = turn @ (from_centre + row[:3]), step
    return found


def _standing(body: Bdp, pose: Pose) -> Pose:
    """The pose with its lowest point on the floor; the heights of the files are not those of a floor."""
    lowest = float(_corners(body, pose)[:, :, 1].min())
    return Pose(pose.position - np.array([0.0, lowest, 0.0]), pose.angles)


def _rows(body: Bdp, poses: Sequence[Pose]) -> Floats:
    """(n, 6 + d): position, rotation vector of the root, joint coordinates, continuous over the rows."""
    rows = []
    for one in (RootedPose.of(TEN_PARTS, body, pose) for pose in poses):
        turn = np.empty(3)
        matrix_to_vector(one.rotation, turn)
        rows.append(np.concatenate([one.position, turn, one.values]))
    found = np.array(rows)
    found[:, 6:] = unwrap_rotations(TEN_PARTS, found[:, 6:])
    return found


def _cycle(rows: Floats, count: int) -> Floats:
    """(count, n) rows, from the most alike pair of rows on periodic."""
    least = round(CYCLE_S * CYCLE_FPS)
    apart = np.linalg.norm(rows[:, None, 3:] - rows[None, :, 3:], axis=2)
    apart[np.arange(len(rows))[:, None] + least > np.arange(len(rows))[None]] = np.inf
    first, last = np.unravel_index(int(np.argmin(apart)), apart.shape)
    share = np.linspace(0.0, 1.0, int(last - first), endpoint=False)[:, None]
    period = rows[first:last] - share * (rows[last] - rows[first])
    return np.tile(period, (-(-count // len(period)), 1))[:count]


def _pose(body: Bdp, row: Floats) -> Pose:
    rotation = np.empty((3, 3))
    vector_to_matrix(row[3:6], rotation)
    return RootedPose(row[:3].copy(), rotation, row[6:].copy()).pose(TEN_PARTS)


def _opening(body: Bdp, first: Pose) -> list[Pose]:
    """The T-pose, held, and the way from it to the first pose of a motion."""
    start, end = _rows(body, [Pose(first.position, t_pose_angles(TEN_PARTS)), first])
    shares = np.linspace(0.0, 1.0, round(LOWERING_S * CYCLE_FPS), endpoint=False)
    between = [_standing(body, _pose(body, start + share * (end - start))) for share in shares]
    return [between[0]] * round(T_POSE_S * CYCLE_FPS) + between


def _trained(name: str, poses: Sequence[Pose], regions: int) -> Prior:
    plan = TrainingPlan(rate=CYCLE_FPS, regions=regions, candidates=COUNTS)
    return train(coordinates_of(TEN_PARTS), [motion_of(name, CYCLE_FPS, TEN_PARTS, list(poses))], [], plan)


def _film(name: str, seed: int, body: Bdp, poses: Sequence[Pose], motion_from: int) -> SimulatedClip:
    cameras = {view: camera.resized(SIZE) for view, camera in cameras_of(VIEWS).items()}
    masks = stored(partial(_masks, cameras, body, poses), name, seed, sources=(__name__,))
    frames = np.arange(len(poses), dtype=np.int64)
    points = np.array([joint_centres(TEN_PARTS, body, pose) for pose in poses])
    instants = tuple(
        Instant(k, round(k * 1e9 / CYCLE_FPS), {view: masks[view][k] for view in cameras}) for k in range(len(poses))
    )
    truth = Trajectories(NAMES, frames, frames / CYCLE_FPS, points, CYCLE_FPS)
    return SimulatedClip(cameras, instants, truth, motion_from, round(1e9 / CYCLE_FPS))


def _masks(cameras: Mapping[str, Camera], body: Bdp, poses: Sequence[Pose]) -> dict[str, Bytes]:
    """(frames, rows, bytes) packed silhouettes by camera."""
    return {
        view: np.stack([np.packbits(silhouette(camera, body, pose), axis=1) for pose in poses])
        for view, camera in cameras.items()
    }


def silhouette(camera: Camera, body: Bdp, pose: Pose) -> Mask:
    """(height, width) of 0 and 1: the pixels whose centres see a part of a body."""
    none, cover = np.zeros(camera.size[::-1], np.uint8), np.zeros(camera.size[::-1], np.uint8)
    totals = np.zeros(3, np.int64)
    for points in _corners(body, pose):
        outline = cv2.convexHull(camera.project(points).astype(np.float32))[:, 0].astype(np.float64)
        cover_outline(np.ascontiguousarray(outline), none, cover, ADD, totals)
    return (cover > 0).astype(np.uint8)


def _corners(body: Bdp, pose: Pose) -> Floats:
    """(parts, points, 3) on the ends of every part, whose convex hull is the part."""
    frames = part_frames(TEN_PARTS, body, pose)
    return np.array([end_ellipses(frame, size, CORNERS) for frame, size in zip(frames, body.sizes, strict=True)])
