"""The better of two directions for each section of the body: trunk with the root, arms, legs.

In each frame every choice, 2^5 of them, has a cost: the misfit of the composed pose in the scene, how probable it is that
its sections are right, and what it differs from that of the frame before.  The sequence of choices with the least sum is
found by dynamic programming (Viterbi), so that a change happens where both directions agree, if they do.
"""

# Paper (added): [Hybrid V] goes forwards only; recordings are tracked backwards as well.

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.rotations import matrix_to_vector
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, misfit
from zenocap.services.tracker.filter.confidence import Confidence

SECTIONS = ("trunk", "right_arm", "left_arm", "right_leg", "left_leg")
ENDS = {"shoulder": "arm", "elbow": "arm", "wrist": "arm", "hip": "leg", "knee": "leg", "ankle": "leg"}
LEAST_PROBABILITY = 1e-3
CHOICES = 1 << len(SECTIONS)
BACKWARD: Bools = (np.arange(CHOICES)[:, None] >> np.arange(len(SECTIONS))) % 2 == 1  # (choices, sections)


@dataclass(frozen=True, eq=False, slots=True)
class TwoPoses:
    """Poses of one frame, None where a direction has none; not both.  misfits: (CHOICES,) m^2 of the composed poses.

    ahead, back: confidence of the forward and of the backward pose, None where it is unknown.
    """

    captured_ns: int
    forward: RootedPose | None
    backward: RootedPose | None
    misfits: Floats
    ahead: Confidence | None = None
    back: Confidence | None = None


@lru_cache
def columns_of(anatomy: Anatomy) -> tuple[Ints, ...]:
    """Joint coordinates of each of SECTIONS."""
    found: dict[str, list[int]] = {section: [] for section in SECTIONS}
    for k, name in enumerate(coordinates_of(anatomy).names):
        side, _, joint = name.partition(".")[0].partition("_")
        found[f"{side}_{ENDS[joint]}" if joint in ENDS else SECTIONS[0]].append(k)
    return tuple(np.array(found[section], dtype=np.int64) for section in SECTIONS)


def two_poses(
    anatomy: Anatomy, model: BodyModel, captured_ns: int, forward: RootedPose | None, backward: RootedPose | None,
    evidence: Evidence, confidences: tuple[Confidence | None, Confidence | None],
) -> TwoPoses | None:  # fmt: skip
    """Both poses of a frame with the misfits of all choices; None without a pose.  confidences: of both."""
    only = forward or backward
    if only is None:
        return None
    misfits = np.zeros(CHOICES)
    if forward is not None and backward is not None:
        for choice, backwards in enumerate(BACKWARD):
            pose = blended(anatomy, forward, backward, backwards.astype(np.float64))
            misfits[choice] = misfit(model, evidence, p.RESIDUAL_LIMIT_M, pose)
    return TwoPoses(captured_ns, forward, backward, misfits, *confidences)


def blended(anatomy: Anatomy, forward: RootedPose, backward: RootedPose, shares: Floats) -> RootedPose:
    """Pose between two poses.  shares: (sections,) of the backward pose, 0 to 1."""
    values = forward.values.copy()
    for share, columns in zip(shares, columns_of(anatomy), strict=True):
        values[columns] += share * (backward.values[columns] - forward.values[columns])
    share = float(shares[0])
    if share in (0.0, 1.0):
        root = (forward, backward)[int(share)]
        return RootedPose(root.position.copy(), root.rotation.copy(), values)
    position = forward.position + share * (backward.position - forward.position)
    turn = np.asarray(Rotation.from_rotvec(share * _turn(forward, backward)).as_matrix(), dtype=np.float64)
    return RootedPose(position, np.ascontiguousarray(forward.rotation @ turn), values)


def fused(anatomy: Anatomy, frames: Sequence[TwoPoses], frame_ns: int) -> Iterator[tuple[RootedPose, Floats]]:
    """Yield the pose of each of successive frames, and the shares (sections,) of the backward pass in it.

    frame_ns: frame period.

    The change from one direction to the other takes FUSION_BLEND_S while both are alike, and is at once otherwise.
    """
    chosen = BACKWARD[best_choices(anatomy, frames, frame_ns)].astype(np.float64)
    half = round(0.5e9 * p.FUSION_BLEND_S / frame_ns)
    window = np.bartlett(2 * half + 3)[1:-1]
    padded = np.pad(chosen, ((half, half), (0, 0)), mode="edge")
    gradual = np.round([np.convolve(column, window / window.sum(), "valid") for column in padded.T], 6).T
    for frame, hard, soft in zip(frames, chosen, gradual, strict=True):
        pose, shares = frame.backward if frame.forward is None else frame.forward, hard
        assert pose is not None, "a frame has one pose at least"
        if frame.forward is not None and frame.backward is not None:
            shares = np.where(_alike(anatomy, frame.forward, frame.backward), soft, hard)
            pose = blended(anatomy, frame.forward, frame.backward, shares)
        yield pose, shares


def _alike(anatomy: Anatomy, forward: RootedPose, backward: RootedPose) -> Bools:
    """(sections,) whether both poses of a section are nearly the same, so that those between them are sensible."""
    place, angle, joint = p.FUSION_ALIKE
    apart = np.abs(forward.values - backward.values)
    alike: Bools = np.array([apart[columns].max(initial=0.0) < joint for columns in columns_of(anatomy)])
    turn, shift = np.linalg.norm(_turn(forward, backward)), np.linalg.norm(forward.position - backward.position)
    alike[0] &= bool(turn < angle and shift < place)
    return alike


def best_choices(anatomy: Anatomy, frames: Sequence[TwoPoses], frame_ns: int) -> Ints:
    """(n,) choices with the least sum of costs over successive frames."""
    cost, back = _frame_cost(frames[0]), []
    for before, now in pairwise(frames):
        periods = max(1.0, (now.captured_ns - before.captured_ns) / frame_ns)
        change = np.zeros((CHOICES, CHOICES))
        for section, costs in enumerate(_change_costs(anatomy, before, now, periods)):
            side = BACKWARD[:, section].astype(np.int64)
            change += costs[side[:, None], side[None]]
        total = cost[:, None] + change
        back.append(np.argmin(total, axis=0).astype(np.uint8))
        cost = total.min(axis=0) + _frame_cost(now)
    choices = np.empty(len(frames), dtype=np.int64)
    choices[-1] = np.argmin(cost)
    for k in range(len(back) - 1, -1, -1):
        choices[k] = back[k][choices[k + 1]]
    return choices


def _frame_cost(frame: TwoPoses) -> Floats:
    """(CHOICES,) negative logarithm of the likelihood; infinite for a direction without a pose."""
    cost: Floats = p.FUSION_INFORMATION * frame.misfits + p.FUSION_DOUBT * _doubts(frame)
    if frame.forward is None:
        cost[:-1] = np.inf  # the last choice: all of the backward pose
    elif frame.backward is None:
        cost[1:] = np.inf
    return cost


def _doubts(frame: TwoPoses) -> Floats:
    """(CHOICES,) negative logarithm of the probability that all sections are right, 0 where one direction states none."""
    if frame.ahead is None or frame.back is None:
        return np.zeros(CHOICES)
    stated = [(one.heading, *(one.limbs.get(limb) for limb in SECTIONS[1:])) for one in (frame.ahead, frame.back)]
    known = [None not in both for both in zip(*stated, strict=True)]
    sides = np.array([[-np.log(max(one or 0.0, LEAST_PROBABILITY)) for one in side] for side in stated])
    doubts: Floats = np.where(BACKWARD, sides[1], sides[0]) @ np.array(known, dtype=np.float64)
    return doubts


def _change_costs(anatomy: Anatomy, before: TwoPoses, now: TwoPoses, periods: float) -> Floats:
    """(sections, 2, 2) cost of a section's change from a direction to a direction, 0 forward, 1 backward."""
    place, angle, joint = p.FUSION_DEVIATION
    costs = np.zeros((len(SECTIONS), 2, 2))
    for i, last in enumerate((before.forward, before.backward)):
        for j, pose in enumerate((now.forward, now.backward)):
            if last is None or pose is None:
                continue
            squares = (pose.values - last.values) ** 2 / joint**2
            costs[:, i, j] = [squares[columns].sum() for columns in columns_of(anatomy)]
            costs[0, i, j] += np.sum((pose.position - last.position) ** 2) / place**2
            costs[0, i, j] += np.sum(_turn(last, pose) ** 2) / angle**2
    costs *= 0.5 / periods
    costs[:, 0, 1] += p.FUSION_SWITCH
    costs[:, 1, 0] += p.FUSION_SWITCH
    return costs


def _turn(start: RootedPose, end: RootedPose) -> Floats:
    """Rotation vector (3,) from one orientation of the root to another, in the frame of the first."""
    vector = np.empty(3)
    matrix_to_vector(np.ascontiguousarray(start.rotation.T @ end.rotation), vector)
    return vector
