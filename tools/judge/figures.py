"""Figures of a take: silhouettes against the body and each other, speed and limits of the poses."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import camera_of, silhouette_mask
from zenocap.common.lags.tangents import Baseline, Outline, baseline_of, outline_of, scene_centre, tangents
from zenocap.tools.judge import parameters
from zenocap.tools.judge.evidence import PoseRow, TakeBody, TakeEvidence
from zenocap.tools.judge.overlap import ViewSample, body_points, reduced, reduced_mask, view_sample

MOTION = ("jump", "shaking", "passes", "limits")


@dataclass(frozen=True, slots=True)
class SampleFigures:
    """seen: whether a view shows the person.  posed: whether there is a pose."""

    captured_ns: int
    seen: bool
    posed: bool
    views: Mapping[str, ViewSample]
    apart: Mapping[tuple[str, str], Floats]  # see `_apart` and `_set_speeds`


def sample_figures(evidence: TakeEvidence, body: TakeBody) -> list[SampleFigures]:
    """Figures of the silhouettes at every sampled pose; with fewer than two views beside a frozen one there is none."""
    cameras = {viewer: camera_of(one) for viewer, one in evidence.cameras.items()}
    small = {viewer: reduced(camera) for viewer, camera in cameras.items()}
    baselines: dict[tuple[str, str], Baseline | None] = {}
    found: list[SampleFigures] = []
    for number, sample in sorted(evidence.samples.items()):
        row = None if sample.pose_ns is None else evidence.poses.get(sample.pose_ns)
        alone = sample.frozen and sum(bool(one.data) for one in sample.silhouettes.values()) < 2
        posed = row is not None and not row.lost and not alone
        points = None
        if row is not None and posed:
            points = body_points(body.anatomy, body.bdp, body.pose(row))
        views: dict[str, ViewSample] = {}
        outlines: dict[str, Outline] = {}
        for viewer, silhouette in sample.silhouettes.items():
            if viewer not in cameras:
                continue
            try:
                mask = silhouette_mask(silhouette, cameras[viewer].size)
            except ValueError:  # damaged, or of another size
                continue
            views[viewer] = view_sample(small[viewer], reduced_mask(mask, small[viewer]), points)
            outline = outline_of(cameras[viewer], mask, 0.0) if posed and views[viewer].area > parameters.MIN_AREA else None
            if outline is not None:
                outlines[viewer] = outline
        captured_ns = number * parameters.SAMPLE_NS if sample.pose_ns is None else sample.pose_ns
        found.append(SampleFigures(captured_ns, False, posed, views, _apart(cameras, outlines, baselines)))
    _set_speeds(found)
    usual = _usual_areas(found)
    return [
        replace(one, seen=any(view.area > parameters.PERSON_AREA * usual[viewer] for viewer, view in one.views.items()))
        for one in found
    ]


def _usual_areas(samples: Sequence[SampleFigures]) -> dict[str, float]:
    """By viewer: median area of the silhouettes while the person is tracked."""
    areas: dict[str, list[float]] = defaultdict(list)
    for sample in samples:
        for viewer, view in sample.views.items():
            if sample.posed or viewer not in areas:
                areas[viewer].append(view.area if sample.posed else parameters.MIN_AREA)
    return {viewer: max(parameters.MIN_AREA, float(np.median(values))) for viewer, values in areas.items()}


def _set_speeds(samples: Sequence[SampleFigures]) -> None:
    """Replace the places of `_apart` by their change from sample to sample, NaN where one is missing."""
    places = [{pair: values[2].copy() for pair, values in one.apart.items()} for one in samples]
    for before, one, after in zip([{}, *places[:-1]], samples, [*places[1:], {}], strict=True):
        for pair, values in one.apart.items():
            values[2] = 0.5 * (after[pair] - before[pair]) if pair in before and pair in after else np.nan


def _apart(
    cameras: Mapping[str, Camera], outlines: Mapping[str, Outline], baselines: dict[tuple[str, str], Baseline | None]
) -> dict[tuple[str, str], Floats]:
    """(3, 2) by pair of views, of both tangent planes, px of the mean of both images, NaN where unknown: how much higher
    that of the first view is; the same at the feet, which are no part of the former; and place of the plane.

    baselines: filled, once per pair.
    """
    found: dict[tuple[str, str], Floats] = {}
    if len(outlines) < 2:
        return found
    scene = scene_centre([cameras[name] for name in outlines], [[one] for one in outlines.values()])
    for pair in combinations(sorted(outlines), 2):
        if pair not in baselines:
            baselines[pair] = baseline_of(cameras[pair[0]], cameras[pair[1]], scene)
        baseline = baselines[pair]
        if baseline is None:
            continue
        ends = [tangents([outlines[name]], baseline) for name in pair]
        if not all(len(one.times) for one in ends):  # too wide
            continue
        angles, rays = np.concatenate([one.angles for one in ends]), np.concatenate([one.rays for one in ends])
        sines = np.maximum(parameters.LEAST_SINE, np.linalg.norm(np.cross(rays, baseline.axis), axis=2))
        focal_px = np.array([[0.5 * (cameras[name].matrix[0, 0] + cameras[name].matrix[1, 1])] for name in pair])
        pixel_rad = np.copysign(np.sqrt(np.mean((focal_px * sines) ** -2, axis=0)), baseline.side[1])
        heights = [outlines[name].rays[:, 1] for name in pair]
        floor = np.array([[own.min() + parameters.FEET_SHARE * np.ptp(own)] for own in heights])
        feet, higher = np.any(rays[:, :, 1] <= floor, axis=0), (angles[0] - angles[1]) / pixel_rad
        figures = [(higher, feet), (higher, ~feet), (angles.mean(axis=0) / pixel_rad, feet)]
        found[pair] = np.stack([np.where(without, np.nan, values) for values, without in figures])
    return found


def motion_figures(evidence: TakeEvidence, body: TakeBody, times: Ints, rows: Sequence[PoseRow]) -> Floats:
    """(n, MOTION) of every pose: whether the step to it is too fast, change of speed m/s, distance of passes m, angles at
    the ends of their ranges; NaN where unknown."""
    out = np.full((len(rows), len(MOTION)), np.nan)
    ends = np.full((len(rows), len(body.anatomy.parts), 3), np.nan)
    limits = body.anatomy.limits[body.order]
    low, high = limits[:, 0] + parameters.LIMIT_RAD, limits[:, 1] - parameters.LIMIT_RAD
    single = np.array([len(joint.axes) == 1 for joint in body.anatomy.joints for _ in joint.axes])[body.order]
    for k, row in enumerate(rows):
        if row.lost:
            continue
        ends[k] = _ends(body, body.pose(row))
        out[k, 3] = np.mean((row.angles > high) | (~single & (row.angles < low)))
        ahead = evidence.forward.get(int(times[k]))
        if evidence.both and ahead is not None and not ahead.lost:
            apart = np.linalg.norm(_ends(body, body.pose(ahead)) - ends[k], axis=1)
            out[k, 2] = min(parameters.MOST_DISAGREEMENT_M, float(np.mean(apart)))
    steps_s = np.diff(times) / 1e9
    if len(rows) > 1:
        velocity = np.diff(ends, axis=0) / np.maximum(steps_s, 1e-3)[:, None, None]
        velocity[steps_s > parameters.LONGEST_STEP_S] = np.nan
        speed = np.linalg.norm(velocity, axis=2)
        known = np.isfinite(speed).all(axis=1)
        fast: Bools = (speed[:, 0] > parameters.FAST_TRUNK) | (speed.max(axis=1) > parameters.FAST_LIMB)
        out[1:, 0] = np.where(known, fast, np.nan)
        change = np.linalg.norm(np.diff(velocity, axis=0), axis=2).mean(axis=1)
        out[2:, 1] = np.minimum(change, parameters.MOST_SHAKING)
    return out


def _ends(body: TakeBody, pose: Pose) -> Floats:
    """(parts, 3) far ends of the parts, metres."""
    frames = part_frames(body.anatomy, body.bdp, pose)
    ends: Floats = frames[:, :, 3] + body.bdp.sizes[:, :1] * frames[:, :, 1]
    return ends
