"""Smoothing of live poses: the One Euro filter, a low-pass whose cut-off frequency rises with speed.

A person at rest is smoothed strongly, one in motion follows at once.  [Casiez, Roussel, Vogel, "1 Euro Filter: A Simple
Speed-based Low-pass Filter for Noisy Input in Interactive Systems", CHI 2012]  Position: a vector; ball joints and root:
rotations, blended along the shortest way; hinges: angles.  So the result is the same in every world frame.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Pose
from zenocap.common.body.pose_rotations import PoseRotations, joint_angles, pose_rotations, root_jumps

SPEED_HZ = 1.0  # cut-off frequency of the speed, dcutoff  [Casiez 2012, 2]
MAX_GAP_NS = 250_000_000  # between poses; after a longer gap the filter starts again, as recorded poses do; by hand
DEFAULT_HZ, DEFAULT_BETA = 2.0, 4.0  # tuned on simulated people with motion capture: python -m benchmarks jitter


@dataclass(frozen=True)
class OneEuro:
    """hz: cut-off frequency at rest, mincutoff.  beta: its rise per m/s or rad/s (Hz)."""

    hz: float = DEFAULT_HZ
    beta: float = DEFAULT_BETA


@dataclass(frozen=True, eq=False)
class Filtered:
    """State after a pose.  raw: the pose.  smooth: the filtered one, both of one row.  captured_ns: of the pose.

    speeds: filtered velocities: (3,) m/s of the position, (balls, 3) rad/s in the parts' own frames, (hinges,) rad/s.
    """

    captured_ns: int
    raw: PoseRotations
    smooth: PoseRotations
    speeds: tuple[Floats, Floats, Floats]


def filtered(
    anatomy: Anatomy, options: OneEuro, last: Filtered | None, captured_ns: int, pose: Pose
) -> tuple[Filtered, Pose]:
    """Return the next state and the smoothed pose.

    last: None for the first pose and after a lost person.  The filter starts again, and returns the pose itself, after a
    gap, a jump of the root, and when time does not rise.
    """
    raw = pose_rotations(anatomy, pose.position[None], pose.angles[None])
    if last is None or not 0 < captured_ns - last.captured_ns <= MAX_GAP_NS or _jumped(last, raw, captured_ns):
        balls, hinges = raw.quaternions.shape[1], raw.hinges.shape[1]
        return Filtered(captured_ns, raw, raw, (np.zeros(3), np.zeros((balls, 3)), np.zeros(hinges))), pose
    step_s = (captured_ns - last.captured_ns) / 1e9
    here, before = Rotation.from_quat(raw.quaternions[0]), Rotation.from_quat(last.raw.quaternions[0])
    turned = np.asarray((before.inv() * here).as_rotvec(), dtype=np.float64)
    moves = (raw.positions[0] - last.raw.positions[0], turned, raw.hinges[0] - last.raw.hinges[0])
    rate = _weight(np.array(SPEED_HZ), step_s)
    speeds = [old + rate * (move / step_s - old) for move, old in zip(moves, last.speeds, strict=True)]
    move, turn, bend = speeds
    position = _blend(
        last.smooth.positions[0], raw.positions[0], _cutoff(options, np.asarray(np.linalg.norm(move))), step_s
    )
    hinges = _blend(last.smooth.hinges[0], raw.hinges[0], _cutoff(options, np.abs(bend)), step_s)
    smooth_before = Rotation.from_quat(last.smooth.quaternions[0])
    weights = _weight(_cutoff(options, np.linalg.norm(turn, axis=1)), step_s)
    way = np.asarray((smooth_before.inv() * here).as_rotvec(), dtype=np.float64)
    quaternions = np.asarray((smooth_before * Rotation.from_rotvec(weights[:, None] * way)).as_quat(), dtype=np.float64)
    smooth = PoseRotations(position[None], quaternions[None], hinges[None])
    angles = joint_angles(anatomy, smooth, pose.angles[None])[0]
    return Filtered(captured_ns, raw, smooth, (move, turn, bend)), Pose(position, angles)


def _jumped(last: Filtered, raw: PoseRotations, captured_ns: int) -> bool:
    both = PoseRotations(
        np.concatenate([last.raw.positions, raw.positions]),
        np.concatenate([last.raw.quaternions, raw.quaternions]),
        np.concatenate([last.raw.hinges, raw.hinges]),
    )
    return bool(root_jumps(both, np.array([0.0, (captured_ns - last.captured_ns) / 1e9]))[0])


def _cutoff(options: OneEuro, speed: Floats) -> Floats:
    """Cut-off frequency, Hz.  [Casiez 2012, Eq. 5]"""
    hz: Floats = options.hz + options.beta * speed
    return hz


def _weight(hz: Floats, step_s: float) -> Floats:
    """Weight alpha of the new value in exponential smoothing with cut-off frequency `hz`.  [Casiez 2012, Eq. 3, 4]"""
    weight: Floats = 1.0 / (1.0 + 1.0 / (2.0 * pi * hz * step_s))
    return weight


def _blend(before: Floats, now: Floats, hz: Floats, step_s: float) -> Floats:
    blended: Floats = before + _weight(hz, step_s) * (now - before)
    return blended
