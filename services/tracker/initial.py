"""The initial posture, arms stretched sideways: seen in a scene, however cluttered, and measured for the body."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Bdp, Pose
from common.body.proportions import HIP_HEIGHT, stretched_angles
from services.tracker.closest import Singles, points_of
from services.tracker.measuring import EFFECTIVE, LIMIT_M, Measured, Sample, measure
from services.tracker.model import model_of
from services.tracker.places import BELOW_M, Column, column_in, reliability, within
from services.tracker.posed import Posed
from services.tracker.refine import distances_of, misfit_of
from services.tracker.room import Room
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

SHORTEST_M, TALLEST_M = 0.8, 2.4
SPAN = (0.65, 1.25)  # of the outstretched arms, in statures
ARMS = 0.18  # statures from the middle: there is nothing but arms,
AT = (0.62, 0.95)  # at this height in statures,
BAR = 0.09  # and so far, in statures, beside the line along both
SLOT = 0.06  # statures: of an arm that is seen everywhere, no such piece is empty but for
GAPS = 2  # pieces
DIRECTIONS = 36  # in which the arms are looked for
AROUND = 0.65  # statures from the middle: there is nothing of the person further out
GOOD_GAP_M = 0.015  # of a body in a scene without clutter
DISTRUST = 2.0  # power of the gap that trust in the scenes falls with
STRAY_M = 0.10  # from that body: clutter
CLEARLY = 0.9  # of the misfit of the body facing the other way
MOST_GAP_M = 0.03  # of a body that was measured well
HELD = 0.25  # rad around the initial posture
FURTHEST = np.radians(40.0)  # of a shoulder or elbow from the initial posture
ROUNDS = 20
FEET, SHANKS = 0.04, (0.10, 0.22)  # heights in statures


@dataclass(frozen=True)
class Stretched:
    """The initial posture as a scene shows it.  centre: (2,) x, z.  across: (2,) unit, along the arms.  low, stature: m."""

    centre: Floats
    across: Floats
    low: float
    stature: float


@dataclass(frozen=True)
class Start:
    """faces: whether it is clear which way.  trust: in these scenes, beside scenes without clutter, in (0, 1]."""

    measured: Measured
    faces: bool
    trust: float


def stretched_in(rays: Singles) -> Stretched | str:
    """The initial posture in a scene of rays (11, n), or what is missing of it, in words."""
    column = column_in(rays)
    if column is None:
        return "waiting for a person"
    stature = column.top - max(column.low, -BELOW_M)
    if not SHORTEST_M <= stature <= TALLEST_M:
        return f"seeing something {stature:.2f} m tall; a person of {SHORTEST_M:g} to {TALLEST_M:g} m is waited for"
    return _arms(rays, column, stature)


def _arms(rays: Singles, column: Column, stature: float) -> Stretched | str:
    """The direction in which something reaches out to both sides at the height of the shoulders."""
    points, low = points_of(rays), column.top - stature
    height = (points[:, 1] - low) / stature
    around = (points[:, [0, 2]] - column.centre) / stature
    high = (height > AT[0]) & (height < AT[1]) & (np.linalg.norm(around, axis=1) < AROUND)
    if np.count_nonzero(high & (np.linalg.norm(around, axis=1) > ARMS)) < 10:
        return "stretch both arms sideways"
    around, weights = around[high], reliability(rays[:, high])
    best: tuple[float, Floats, float] | None = None
    for turn in np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
        across = np.array([np.cos(turn), np.sin(turn)])
        beside = np.abs(around @ np.array([-across[1], across[0]])) < BAR
        along = around[beside] @ across
        reach = min(_reach(along), _reach(-along))
        score = min(reach, 0.5) * float(weights[beside][np.abs(along) > ARMS].sum())
        if best is None or score > best[0]:
            best = score, across, reach
    assert best is not None
    _, across, reach = best
    if reach < 0.5 * SPAN[0]:
        return "stretch both arms sideways, at the height of the shoulders"
    return Stretched(column.centre, _line(around, weights, across), low, stature)


def _reach(along: Floats) -> float:
    """How far, in statures, places along a line go on from the trunk without a gap."""
    slots = np.bincount(np.floor(along[(along > 0) & (along < AROUND)] / SLOT).astype(np.int64), minlength=1)
    end = int(ARMS / SLOT)
    for slot in range(end, len(slots)):
        if slots[slot]:
            if slot - end > GAPS:
                break
            end = slot
    return (end + 1) * SLOT


def _line(around: Floats, weights: Floats, across: Floats) -> Floats:
    """(2,) the line across, through the arms seen around it."""
    aside = around @ np.array([-across[1], across[0]])
    arms = (np.abs(aside) < BAR) & (np.abs(around @ across) > ARMS)
    _, axes = np.linalg.eigh((around[arms] * weights[arms, None]).T @ around[arms])
    line: Floats = axes[:, 1]
    return line


def near_to(rays: Singles, seen: Stretched) -> Singles:
    """(11, m) the rays of a scene that may have to do with the person."""
    return within(rays, Column(seen.centre, seen.low, seen.low + seen.stature), AROUND * seen.stature)


def measured_from(
    anatomy: Anatomy, scenes: Sequence[Singles], rooms: Sequence[Room], seen: Sequence[Stretched]
) -> Start | str:
    """The body, from rays (11, n) and rooms of several scenes of the initial posture; or why it is not believed, in words.

    Who faces which way along the same line is told by the feet and the belly: both ways are fitted.
    """
    held = coordinates_of(anatomy).of_pose(Pose(np.zeros(3), stretched_angles(anatomy)))
    stature = float(np.median([one.stature for one in seen]))
    average = average_body(anatomy, stature)
    rays_near = [near_to(rays, one) for rays, one in zip(scenes, seen, strict=True)]
    found = []
    for side in (1.0, -1.0):
        samples = []
        for rays, one in zip(rays_near, seen, strict=True):
            across = side * one.across * np.sign(one.across @ seen[0].across)
            left, up = np.array([across[0], 0.0, across[1]]), np.array([0.0, 1.0, 0.0])
            rotation = np.stack([left, up, np.cross(left, up)], axis=1)
            position = np.array([one.centre[0], one.low + HIP_HEIGHT * stature, one.centre[1]])
            samples.append(Sample(rays, Posed(position, rotation, held.copy()), held, HELD))
        measured, trust = measure(anatomy, average, samples, np.zeros(COUNT), ROUNDS), 1.0
        if measured.gap > GOOD_GAP_M:
            trust = (GOOD_GAP_M / measured.gap) ** DISTRUST
            measured = _measured_among_clutter(anatomy, average, measured, samples, trust)
        found.append((_misfit(anatomy, measured, rays_near, rooms), measured, trust))
    (error, best, trust), (other, _, _) = sorted(found, key=lambda one: one[0])
    if "right_foot" not in anatomy.parts:  # such a body looks the same from the front and from behind
        forward = sum(_toes(points_of(rays), one, seen[0].across) for rays, one in zip(rays_near, seen, strict=True))
        _, best, trust = found[0] if forward > 0.0 else found[1]
    if not best.gap <= MOST_GAP_M:
        return (
            f"no body fits: gaps of {best.gap * 1000:.0f} mm (at most {MOST_GAP_M * 1000:.0f}); stand still in every view"
        )
    away = max(float(np.abs(pose.values - held).max()) for pose in best.poses)
    if away > FURTHEST:
        return f"stretch both arms straight; a joint is {np.degrees(away):.0f} degrees off"
    return Start(best, error < CLEARLY * other, trust)


def _toes(points: Floats, one: Stretched, across: Floats) -> float:
    """How far, in metres, feet reach forward of shanks in points (n, 3), for who has `across` (2,) to the left."""
    height = (points[:, 1] - one.low) / one.stature
    depth = points[:, [0, 2]] @ np.array([-across[1], across[0]])
    feet, shanks = depth[height < FEET], depth[(height > SHANKS[0]) & (height < SHANKS[1])]
    if not len(feet) or not len(shanks):
        return 0.0
    middles = [0.5 * float(np.sum(np.percentile(part, [5, 95]))) for part in (feet, shanks)]
    return middles[0] - middles[1]


def _misfit(anatomy: Anatomy, measured: Measured, scenes: Sequence[Singles], rooms: Sequence[Room]) -> float:
    """Mean D of the poses in m^2, with what of the body is outside of the silhouettes."""
    model = model_of(anatomy, measured.body)
    return float(
        np.mean(
            [
                misfit_of(model, rays, room, LIMIT_M, pose.position, pose.rotation, pose.values)
                for rays, room, pose in zip(scenes, rooms, measured.poses, strict=True)
            ]
        )
    )


def _measured_among_clutter(
    anatomy: Anatomy, average: Bdp, first: Measured, samples: Sequence[Sample], trust: float
) -> Measured:
    """Again without the rays that have nothing to do with the body, and with as much trust in the others as they earn."""
    model = model_of(anatomy, first.body)
    again = []
    for sample, pose in zip(samples, first.poses, strict=True):
        near = distances_of(model, sample.rays, pose.position, pose.rotation, pose.values) < STRAY_M
        again.append(replace(sample, rays=np.ascontiguousarray(sample.rays[:, near]), pose=pose))
    return measure(anatomy, average, again, np.zeros(COUNT), ROUNDS, trust * EFFECTIVE)
