"""Motion made ready to be learnt: another rate, left and right exchanged, stretches held out."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from common.body.anatomy import Floats
from common.body.coordinates import BALL, HINGE, Coordinates

HELD_EVERY = 5  # stretches, of which one is held out
STRETCH_S = 1.0


def resampled(coordinates: Coordinates, poses: Floats, rate: float, wanted: float) -> Floats:
    """Poses (T, d) at `rate` frames per second as (T', d) at `wanted`, from the same first instant on.

    Hinges in straight lines, ball joints along the shortest turn.
    """
    if rate == wanted or len(poses) < 2:
        return poses
    at = np.arange(int(np.floor((len(poses) - 1) * wanted / rate + 1e-6)) + 1) * (rate / wanted)
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
            result[:, columns] = _near(start, (turned * Rotation.from_rotvec(share * turn)).as_rotvec())
    return result


def _near(near: Floats, vectors: Floats) -> Floats:
    """The same rotations (n, 3), as vectors of whatever length is nearest to `near` (n, 3): turns past pi go on."""
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    axes = vectors / np.maximum(angles, 1e-12)
    turns = np.round((np.sum(axes * near, axis=1, keepdims=True) - angles) / (2 * np.pi))
    found: Floats = vectors + 2 * np.pi * turns * axes
    return found


def mirrored(coordinates: Coordinates, poses: Floats) -> Floats:
    """Poses (T, d) with left and right exchanged: of a rotation vector, the turns about Y and Z change their sign."""
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


def whole_runs(poses: Floats) -> list[Floats]:
    """The runs of poses (T, d) between rows that are not finite."""
    known = np.isfinite(poses).all(axis=1)
    edges = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0))
    return [poses[start:end] for start, end in zip(edges[::2], edges[1::2], strict=True)]


def held_out(sequences: Sequence[Floats], rate: float) -> tuple[list[Floats], list[Floats]]:
    """The sequences in stretches of a second, or a fifth if shorter: what to learn from, and every fifth stretch.

    Stretches that follow on each other stay one sequence.
    """
    learnt, held = [], []
    for poses in sequences:
        length = max(1, min(round(STRETCH_S * rate), len(poses) // HELD_EVERY))
        period = HELD_EVERY * length
        for start in range(0, len(poses), period):
            middle = start + period - length
            learnt.append(poses[start:middle])
            if middle < len(poses):
                held.append(poses[middle : start + period])
    return [poses for poses in learnt if len(poses)], held


def speeds(sequences: Sequence[Floats], rate: float) -> Floats:
    """Root mean square velocity of every coordinate (d,), radians per second."""
    changes = np.concatenate([np.diff(poses, axis=0) for poses in sequences])
    return np.asarray(rate * np.sqrt(np.mean(changes**2, axis=0)))


def _joints(coordinates: Coordinates) -> list[tuple[int, int]]:
    """First coordinate and number of coordinates of every joint that has any."""
    joints = coordinates.anatomy.joints
    found = [(int(first), len(joint.axes)) for joint, first in zip(joints, coordinates.first, strict=True) if first >= 0]
    assert all(kind in (BALL, HINGE) for _, kind in found)
    return found


def _other_side(name: str) -> str:
    for side, other in (("left_", "right_"), ("right_", "left_")):
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
