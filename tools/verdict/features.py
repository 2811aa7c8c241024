"""Figures of a take per stretch of a second, from its evidence: of each view, of pairs of views, and of the poses."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import anatomy_of, bdp_of
from zenocap.common.vision.mask_codec import unpack
from zenocap.tools.sync.tangents import WIDEST_RAD, Baseline, Outline, baseline_of, outline_of, scene_centre
from zenocap.tools.verdict.evidence import LIMBS, Evidence, PoseRow
from zenocap.tools.verdict.overlap import ViewSample, body_points, reduced, reduced_mask, view_sample
from zenocap.tools.verdict.parameters import (
    APART_NOISE_M,
    FAST_LIMB,
    FAST_TRUNK,
    LIMIT_RAD,
    LONGEST_STEP_S,
    MIN_AREA,
    MOST_APART_M,
    MOST_DISAGREEMENT_M,
    MOST_SHAKING,
    PERSON_AREA,
    SAMPLE_NS,
    START_NS,
    STRETCH_NS,
)

FEATURES = (
    "outside",  # share of the silhouette outside the body, worst view
    "outside, all views",  # mean over the views
    "uncovered",  # share of the body outside the silhouette, worst view
    "uncovered, all views",
    "apart",  # distance of the tangent planes of pairs of views, over its noise, worst view
    "cut",  # share of silhouettes at the border of the image
    "hidden",  # share of the body outside the images
    "empty",  # share of views without silhouette
    "unused",  # share of views that the tracker left out
    "pieces",  # share of the silhouettes outside their largest piece
    "flicker",  # mean change of the logarithm of a silhouette's area between samples
    "limbs",  # mean probability of a limb to be wrong
    "worst limb",  # the same, of the worst limb
    "heading",  # probability that front and back are exchanged
    "lost",  # share of frames without the person
    "jumps",  # share of steps that are faster than a person
    "shaking",  # m/s: change of the joints' speed from frame to frame
    "passes",  # m: distance of the joints between the forward pass and both passes
    "limits",  # share of joint angles at the end of their range
    "average body",  # 1 where the body was not measured
    "few views",  # 2 over the number of views
)


@dataclass(frozen=True)
class Stretch:
    """Figures of about a second.  values: (FEATURES,), NaN where unknown.  views: mean figures by viewer, see `ViewSample`.

    apart: m, mean over the pairs with other views, by viewer.  frames: number of poses.
    """

    start_ns: int
    end_ns: int
    values: Floats
    views: Mapping[str, ViewSample]
    apart: Mapping[str, float]
    frames: int


@dataclass(frozen=True)
class _Body:
    anatomy: Anatomy
    bdp: Bdp
    order: Ints  # of the evidence's angles in those of the anatomy

    def pose(self, row: PoseRow, names: Sequence[str]) -> Pose:
        angles = self.anatomy.neutral.copy()
        angles[self.order] = row.angles
        return Pose(row.position, angles)


def stretches_of(evidence: Evidence) -> list[Stretch]:
    """Stretches in which the person is in view; empty without poses.

    The first START_NS in view do not count, unless there are poses: the tracker needs them to start.
    """
    message = evidence.body
    if message is None or not evidence.poses:
        return []
    try:
        anatomy = anatomy_of(message)
        order = np.array([anatomy.index[name] for name in evidence.names], dtype=np.int64)
        body = _Body(anatomy, bdp_of(anatomy, message), order)
    except (ValueError, KeyError):  # of another version: nothing can be said about the poses
        return []
    times = np.array(sorted(evidence.poses), dtype=np.int64)
    rows = [evidence.poses[ns] for ns in times.tolist()]
    samples = _samples(evidence, body)
    motion = _motion(evidence, body, times, rows)
    seen = [one.captured_ns for one in samples if one.seen]
    begin_ns, end_ns = int(times[0]), int(times[-1])
    if seen:
        begin_ns, end_ns = min(begin_ns, seen[0] + START_NS), max(end_ns, seen[-1])
    step_ns = float(np.median(np.diff(times))) if len(times) > 1 else float(STRETCH_NS)
    groups: dict[int, list[_Sampled]] = defaultdict(list)
    for sample in samples:
        groups[(sample.captured_ns - begin_ns) // STRETCH_NS].append(sample)
    numbers = (times - begin_ns) // STRETCH_NS
    found = []
    for number in range(max(1, round((end_ns - begin_ns) / STRETCH_NS))):
        inside = np.flatnonzero(numbers == number)
        span = begin_ns + number * STRETCH_NS, min(end_ns, begin_ns + (number + 1) * STRETCH_NS)
        one = _stretch(evidence, span, [rows[k] for k in inside], times[inside], groups[number], motion[inside], step_ns)
        if one is not None:
            found.append(one)
    return found


@dataclass(frozen=True, slots=True)
class _Sampled:
    """seen: whether a view shows the person.  posed: whether there is a pose."""

    captured_ns: int
    seen: bool
    posed: bool
    views: Mapping[str, ViewSample]
    apart: Mapping[tuple[str, str], tuple[float, float]]  # see `_apart`


def _samples(evidence: Evidence, body: _Body) -> list[_Sampled]:
    """Figures of the silhouettes at every sampled pose."""
    cameras = {viewer: camera_of(one) for viewer, one in evidence.cameras.items()}
    small = {viewer: reduced(camera) for viewer, camera in cameras.items()}
    baselines: dict[tuple[str, str], Baseline | None] = {}
    found: list[_Sampled] = []
    for number, sample in sorted(evidence.samples.items()):
        row = None if sample.pose_ns is None else evidence.poses.get(sample.pose_ns)
        posed = row is not None and not row.lost
        points = None
        if row is not None and posed:
            points = body_points(body.anatomy, body.bdp, body.pose(row, evidence.names))
        views: dict[str, ViewSample] = {}
        outlines: dict[str, Outline] = {}
        for viewer, silhouette in sample.silhouettes.items():
            if viewer not in cameras or tuple(silhouette.size) != cameras[viewer].size:
                continue
            try:
                mask = unpack(silhouette.size, silhouette.region, silhouette.data)
            except ValueError:  # damaged
                continue
            views[viewer] = view_sample(small[viewer], reduced_mask(mask, small[viewer]), points)
            outline = outline_of(cameras[viewer], mask, 0.0) if posed and views[viewer].area > MIN_AREA else None
            if outline is not None:
                outlines[viewer] = outline
        captured_ns = number * SAMPLE_NS if sample.pose_ns is None else sample.pose_ns
        found.append(_Sampled(captured_ns, False, posed, views, _apart(cameras, outlines, baselines)))
    usual = _usual_areas(found)
    return [
        replace(one, seen=any(view.area > PERSON_AREA * usual[viewer] for viewer, view in one.views.items()))
        for one in found
    ]


def _usual_areas(samples: Sequence[_Sampled]) -> dict[str, float]:
    """By viewer: median area of the silhouettes while the person is tracked."""
    areas: dict[str, list[float]] = defaultdict(list)
    for sample in samples:
        for viewer, view in sample.views.items():
            if sample.posed or viewer not in areas:
                areas[viewer].append(view.area if sample.posed else MIN_AREA)
    return {viewer: max(MIN_AREA, float(np.median(values))) for viewer, values in areas.items()}


def _apart(
    cameras: Mapping[str, Camera],
    outlines: Mapping[str, Outline],
    baselines: dict[tuple[str, str], Baseline | None],
) -> dict[tuple[str, str], tuple[float, float]]:
    """Distance of the tangent planes of each pair of views at the person, m, and over what noise explains; mean of both.

    baselines: filled, once per pair.
    """
    found: dict[tuple[str, str], tuple[float, float]] = {}
    if len(outlines) < 2:
        return found
    scene = scene_centre([cameras[name] for name in outlines], [[one] for one in outlines.values()])
    for one, other in combinations(sorted(outlines), 2):
        if (one, other) not in baselines:
            baselines[one, other] = baseline_of(cameras[one], cameras[other], scene)
        baseline = baselines[one, other]
        if baseline is None:
            continue
        ends = [_tangents(baseline, outlines[name]) for name in (one, other)]
        across = scene - cameras[one].centre
        distance = float(np.linalg.norm(across - (across @ baseline.axis) * baseline.axis))
        apart = np.abs(ends[0] - ends[1])
        if np.isfinite(apart).any():
            pixel_rad = max(2.0 / float(cameras[name].matrix[0, 0] + cameras[name].matrix[1, 1]) for name in (one, other))
            apart_m = min(MOST_APART_M, distance * float(np.nanmean(apart)))
            found[one, other] = apart_m, apart_m / (APART_NOISE_M + distance * pixel_rad)
    return found


def _tangents(baseline: Baseline, outline: Outline) -> Floats:
    """(2,) angles of the tangent planes about a baseline, radians; NaN where the silhouette is cut there."""
    values = baseline.angles(outline.rays)
    ends = np.array([np.argmin(values), np.argmax(values)])
    if values[ends[1]] - values[ends[0]] > WIDEST_RAD:
        return np.full(2, np.nan)
    return np.where(outline.cut[ends], np.nan, values[ends])


def camera_of(info: m.CameraInfo) -> Camera:
    """The camera of a message."""
    matrix, rotation = np.array(info.matrix).reshape(3, 3), np.array(info.rotation).reshape(3, 3)
    size = int(info.size[0]), int(info.size[1])
    return Camera(info.name, size, matrix, np.array(info.distortions), rotation, np.array(info.translation))


MOTION = ("jump", "shaking", "passes", "limits")


def _motion(evidence: Evidence, body: _Body, times: Ints, rows: Sequence[PoseRow]) -> Floats:
    """(n, MOTION) of every pose: whether the step to it is too fast, change of speed m/s, distance of passes m, angles at
    the ends of their ranges; NaN where unknown."""
    out = np.full((len(rows), len(MOTION)), np.nan)
    ends = np.full((len(rows), len(body.anatomy.parts), 3), np.nan)
    limits = body.anatomy.limits[body.order]
    single = np.array([len(joint.axes) == 1 for joint in body.anatomy.joints for _ in joint.axes])[body.order]
    for k, row in enumerate(rows):
        if row.lost:
            continue
        ends[k] = _ends(body, body.pose(row, evidence.names))
        beyond = (row.angles > limits[:, 1] - LIMIT_RAD) | (~single & (row.angles < limits[:, 0] + LIMIT_RAD))
        out[k, 3] = np.mean(beyond)
        ahead = evidence.forward.get(int(times[k]))
        if evidence.both and ahead is not None and not ahead.lost:
            apart = np.linalg.norm(_ends(body, body.pose(ahead, evidence.names)) - ends[k], axis=1)
            out[k, 2] = min(MOST_DISAGREEMENT_M, float(np.mean(apart)))
    steps_s = np.diff(times) / 1e9
    if len(rows) > 1:
        velocity = np.diff(ends, axis=0) / np.maximum(steps_s, 1e-3)[:, None, None]
        velocity[steps_s > LONGEST_STEP_S] = np.nan
        speed = np.linalg.norm(velocity, axis=2)
        known = np.isfinite(speed).all(axis=1)
        fast: Bools = (speed[:, 0] > FAST_TRUNK) | (speed.max(axis=1) > FAST_LIMB)
        out[1:, 0] = np.where(known, fast, np.nan)
        change = np.linalg.norm(np.diff(velocity, axis=0), axis=2).mean(axis=1)
        out[2:, 1] = np.minimum(change, MOST_SHAKING)
    return out


def _ends(body: _Body, pose: Pose) -> Floats:
    """(parts, 3) far ends of the parts, metres."""
    frames = part_frames(body.anatomy, body.bdp, pose)
    ends: Floats = frames[:, :, 3] + body.bdp.sizes[:, :1] * frames[:, :, 1]
    return ends


def _stretch(
    evidence: Evidence,
    span: tuple[int, int],
    rows: Sequence[PoseRow],
    times: Ints,
    samples: Sequence[_Sampled],
    motion: Floats,
    step_ns: float,
) -> Stretch | None:
    """Figures of one stretch; None where the person is absent.  step_ns: usual time between poses."""
    if any(sample.views for sample in samples):
        there = [sample for sample in samples if sample.seen or sample.posed]
        if not there:
            return None
        lost = float(np.mean([not sample.posed for sample in there]))
        lost = max(lost, float(np.mean([row.lost for row in rows])) if rows else 1.0)
    else:
        expected = max(1.0, (span[1] - span[0]) / step_ns)
        lost = min(1.0, max(0.0, 1.0 - sum(not row.lost for row in rows) / expected))
    views = _view_means(samples)
    apart, ratio = _apart_means(samples, 0), _apart_means(samples, 1)
    seen = [sum(one.area > MIN_AREA for one in sample.views.values()) for sample in samples if sample.posed]
    known = [row for row in rows if not row.lost]
    ahead = [evidence.forward.get(int(ns)) for ns in times]
    limbs = np.array([row.limbs for row in ahead if row is not None and not row.lost]).reshape(-1, LIMBS)
    heading = np.array([row.heading for row in ahead if row is not None and not row.lost])
    cameras = max(len(evidence.cameras), 2)
    values = {
        "outside": _largest([one.outside for one in views.values()]),
        "outside, all views": _mean([one.outside for one in views.values()]),
        "uncovered": _largest([one.uncovered for one in views.values()]),
        "uncovered, all views": _mean([one.uncovered for one in views.values()]),
        "apart": _largest(list(ratio.values())),
        "cut": _mean([float(one.cut) for one in views.values()]),
        "hidden": _mean([one.hidden for one in views.values()]),
        "empty": 1.0 - _mean([count / cameras for count in seen]),
        "unused": 1.0 - _mean([row.used / cameras for row in known]),
        "pieces": _mean([one.pieces for one in views.values()]),
        "flicker": _flicker(samples),
        "limbs": 1.0 - _mean(limbs.ravel()),
        "worst limb": 1.0 - _mean(limbs.min(axis=1) if len(limbs) else []),
        "heading": 1.0 - _mean(heading),
        "lost": lost,
        "jumps": _mean(motion[:, 0]),
        "shaking": _mean(motion[:, 1]),
        "passes": _mean(motion[:, 2]),
        "limits": _mean(motion[:, 3]),
        "average body": float(not evidence.measured),
        "few views": 2.0 / cameras,
    }
    return Stretch(*span, np.array([values[name] for name in FEATURES]), views, apart, len(rows))


def _view_means(samples: Sequence[_Sampled]) -> dict[str, ViewSample]:
    names = sorted({viewer for sample in samples for viewer in sample.views})
    found = {}
    for name in names:
        own = [sample.views[name] for sample in samples if name in sample.views]
        found[name] = ViewSample(
            outside=_mean([one.outside for one in own]),
            uncovered=_mean([one.uncovered for one in own]),
            area=_mean([one.area for one in own]),
            pieces=_mean([one.pieces for one in own]),
            cut=_mean([float(one.cut) for one in own]) > 0.5,
            hidden=_mean([one.hidden for one in own]),
        )
    return found


def _apart_means(samples: Sequence[_Sampled], which: int) -> dict[str, float]:
    """By viewer, mean over its pairs and the samples.  which: of both figures of `_apart`."""
    own: dict[str, list[float]] = defaultdict(list)
    for sample in samples:
        for pair, value in sample.apart.items():
            for viewer in pair:
                own[viewer].append(value[which])
    return {viewer: _mean(values) for viewer, values in sorted(own.items())}


def _flicker(samples: Sequence[_Sampled]) -> float:
    """Mean over the views of the change of the logarithm of the area between successive samples."""
    areas: dict[str, list[float]] = defaultdict(list)
    for sample in samples:
        for viewer, one in sample.views.items():
            areas[viewer].append(max(one.area, MIN_AREA))
    return _mean([float(np.mean(np.abs(np.diff(np.log(values))))) for values in areas.values() if len(values) > 1])


def _mean(values: Sequence[float] | Floats) -> float:
    """Mean of the known ones, NaN without any."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else float("nan")


def _largest(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return max(known, default=float("nan"))
