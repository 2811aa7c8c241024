"""Preparation of motion for training: frame rate, mirroring, held-out stretches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Floats
from zenocap.common.body.coordinates import BALL, HINGE, Coordinates
from zenocap.services.tracker.parameters import HELD_OUT_EVERY, HELD_OUT_STRETCH_S


@dataclass(frozen=True)
class TrainingMotion:
    """Motion for training.

    coordinates: (n, d) radians in the order of `coordinates_of(anatomy).names`, one row per frame, without jumps.
    NaN without a pose.  rate: frames per second.
    """

    name: str
    rate: float
    coordinates: Floats


def resampled(coordinates: Coordinates, poses: Floats, rate: float, target_rate: float) -> Floats:
    """Poses (T, d) at `rate` frames per second as (T', d) at `target_rate`, starting at the same time.

    Hinges by linear interpolation, ball joints along the shortest rotation.
    """
    if rate == target_rate or len(poses) < 2:
        return poses
    at = np.arange(int(np.floor((len(poses) - 1) * target_rate / rate + 1e-6)) + 1) * (rate / target_rate)
    before = np.minimum(at.astype(np.int64), len(poses) - 2)
    share = (at - before)[:, None]
    result = np.empty((len(at), poses.shape[1]))
    for first, kind in _joints(coordinates):
        columns = slice(first, first + kind)
        start, end = poses[before, columns], poses[before + 1, columns]
        if kind == HINGE:
            result[:, columns] = (1 - share) * start + share * end
        else:
            turned = Rotation.from_rotvec(start)
            turn = (turned.inv() * Rotation.from_rotvec(end)).as_rotvec()
            result[:, columns] = _nearest_vectors(start, (turned * Rotation.from_rotvec(share * turn)).as_rotvec())
    return result


def _nearest_vectors(near: Floats, vectors: Floats) -> Floats:
    """The same rotations (n, 3), as the rotation vectors nearest to `near` (n, 3): rotations past pi continue."""
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    axes = vectors / np.maximum(angles, 1e-12)
    turns = np.round((np.sum(axes * near, axis=1, keepdims=True) - angles) / (2 * np.pi))
    found: Floats = vectors + 2 * np.pi * turns * axes
    return found


def mirrored(coordinates: Coordinates, poses: Floats) -> Floats:
    """Poses (T, d) with left and right exchanged: of a rotation vector, the components about Y and Z change sign."""
    result = np.empty_like(poses)
    joints = coordinates.anatomy.joints
    index = {joint.name: k for k, joint in enumerate(joints)}
    for k, joint in enumerate(joints):
        first = int(coordinates.first[k])
        if first < 0:
            continue
        other = int(coordinates.first[index[_other_side(joint.name)]])
        kind = len(joint.axes)
        sign = np.array([1.0, -1.0, -1.0])[:kind]
        result[:, first : first + kind] = sign * poses[:, other : other + kind]
    return result


def finite_runs(poses: Floats) -> list[Floats]:
    """Runs of poses (T, d) between rows that are not finite."""
    known = np.isfinite(poses).all(axis=1)
    edges = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0))
    return [poses[start:end] for start, end in zip(edges[::2], edges[1::2], strict=True)]


def held_out(sequences: Sequence[Floats], rate: float) -> tuple[list[Floats], list[Floats]]:
    """Sequences split in stretches of HELD_OUT_STRETCH_S, shorter ones in fifths: training and held-out ones.

    Consecutive stretches stay one sequence.
    """
    kept, held = [], []
    for poses in sequences:
        length = max(1, min(round(HELD_OUT_STRETCH_S * rate), len(poses) // HELD_OUT_EVERY))
        period = HELD_OUT_EVERY * length
        for start in range(0, len(poses), period):
            middle = start + period - length
            kept.append(poses[start:middle])
            if middle < len(poses):
                held.append(poses[middle : start + period])
    return [poses for poses in kept if len(poses)], held


def rms_velocities(sequences: Sequence[Floats], rate: float) -> Floats:
    """(d,) root mean square velocity of every coordinate, radians per second."""
    changes = np.concatenate([np.diff(poses, axis=0) for poses in sequences])
    return np.asarray(rate * np.sqrt(np.mean(changes**2, axis=0)))


def _joints(coordinates: Coordinates) -> list[tuple[int, int]]:
    """First coordinate and number of coordinates of every joint with coordinates."""
    joints = coordinates.anatomy.joints
    found = [(int(first), len(joint.axes)) for joint, first in zip(joints, coordinates.first, strict=True) if first >= 0]
    assert all(kind in (BALL, HINGE) for _, kind in found)
    return found


def _other_side(name: str) -> str:
    for side, other in (("left_", "right_"), ("right_", "left_")):
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
