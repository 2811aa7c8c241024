"""Figures of a take per stretch of about a second."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.tools.judge import parameters as p
from zenocap.tools.judge.evidence import PoseRow, TakeEvidence, body_of
from zenocap.tools.judge.figures import SampleFigures, motion_figures, sample_figures
from zenocap.tools.judge.overlap import ViewSample

FEATURES = (
    "outside",  # share of the silhouette outside the body, worst view
    "outside, all views",  # mean over the views
    "uncovered",  # share of the body outside the silhouette, worst view
    "uncovered, all views",
    "apart",  # px: distance of the tangents of pairs of views, without the feet, worst view
    "feet apart",  # px: that at the feet, mean with its sign, worst view
    "cut",  # share of silhouettes at the border of the image
    "hidden",  # share of the body outside the images
    "empty",  # share of views without silhouette
    "unused",  # share of views that the tracker left out
    "limbs",  # mean probability of a limb to be wrong
    "worst limb",  # the same, of the worst limb
    "heading",  # probability that front and back are exchanged
    "lost",  # share of frames without the person
    "missing",  # share of frames without a pose that are between two others, too far apart to interpolate one
    "jumps",  # share of steps that are faster than a person
    "shaking",  # m/s: change of the joints' speed from frame to frame
    "passes",  # m: distance of the joints between the forward pass and both passes
    "limits",  # share of joint angles at the end of their range
    "average body",  # 1 where the body was not measured
    "few views",  # 2 over the number of views
)
COLUMN = {name: k for k, name in enumerate(FEATURES)}


@dataclass(frozen=True)
class Apart:
    """Tangents of a view against those of the others, px, without the feet; means, NaN where unknown.

    distance: d.  higher: how much higher its own are: d with its sign.  feet: the same at the feet.  square: d^2.
    along, speed: d v and v^2, where v is the change of their place from sample to sample.
    """

    distance: float
    higher: float
    feet: float
    square: float
    along: float
    speed: float


@dataclass(frozen=True)
class Stretch:
    """Figures of about a second.  values: (FEATURES,), NaN where unknown.  frames: number of poses.

    views: mean figures by viewer, see `ViewSample`.  apart: by viewer.
    """

    start_ns: int
    end_ns: int
    values: Floats
    views: Mapping[str, ViewSample]
    apart: Mapping[str, Apart]
    frames: int

    @property
    def without_pose(self) -> float:
        """Share of frames without a pose, although the person is there."""
        return float(self.values[COLUMN["lost"]] + self.values[COLUMN["missing"]])


def stretches_of(evidence: TakeEvidence) -> list[Stretch]:
    """Stretches in which the person is in view; empty without poses.

    The first START_NS in view, or START_SHARE of the time in view where that is shorter, do not count, unless there are
    poses: the tracker needs them to start.
    """
    body = body_of(evidence)
    if body is None or not evidence.poses:
        return []
    times = np.array(sorted(evidence.poses), dtype=np.int64)
    rows = [evidence.poses[ns] for ns in times.tolist()]
    samples = sample_figures(evidence, body)
    motion = motion_figures(evidence, body, times, rows)
    seen = [one.captured_ns for one in samples if one.seen]
    begin_ns, end_ns = int(times[0]), int(times[-1])
    if seen:
        end_ns = max(end_ns, seen[-1])
        begin_ns = min(begin_ns, seen[0] + min(p.START_NS, int(p.START_SHARE * (end_ns - seen[0]))))
    step_ns = float(np.median(np.diff(times))) if len(times) > 1 else float(p.STRETCH_NS)
    groups: dict[int, list[SampleFigures]] = defaultdict(list)
    for sample in samples:
        groups[(sample.captured_ns - begin_ns) // p.STRETCH_NS].append(sample)
    numbers = (times - begin_ns) // p.STRETCH_NS
    posed = {one.captured_ns // p.SAMPLE_NS for one in samples if one.posed}  # the others count as lost
    missing = np.array([ns for ns in missing_poses(times, step_ns).tolist() if ns // p.SAMPLE_NS in posed], dtype=np.int64)
    missing_numbers = (missing - begin_ns) // p.STRETCH_NS
    away = {one.captured_ns // p.SAMPLE_NS for one in samples if one.views and not (one.seen or one.posed)}
    found = []
    count = max(1, round((end_ns - begin_ns) / p.STRETCH_NS))
    for number in stretch_numbers({*numbers.tolist(), *groups}, count):
        inside = np.flatnonzero(numbers == number)
        span = begin_ns + number * p.STRETCH_NS, min(end_ns, begin_ns + (number + 1) * p.STRETCH_NS)
        absent = int(np.count_nonzero(missing_numbers == number))
        lost = [rows[k].lost for k in inside if away.isdisjoint((times[k] // p.SAMPLE_NS, times[k] // p.SAMPLE_NS + 1))]
        own = StretchPoses([rows[k] for k in inside], motion[inside], absent, lost)
        one = _stretch(evidence, span, own, groups[number], step_ns)
        if one is not None:
            found.append(one)
    return found


def stretch_numbers(known: Collection[int], count: int) -> Iterator[int]:
    """Numbers of the stretches, 0 to `count` - 1; of a gap between `known` ones only the first LONGEST_GAP_NS."""
    inside = sorted({0, *(number for number in known if 0 <= number < count)})
    for number, following in zip(inside, [*inside[1:], count], strict=True):
        yield from range(number, min(following, number + 1 + p.LONGEST_GAP_NS // p.STRETCH_NS))


def missing_poses(times: Ints, step_ns: float) -> Ints:
    """(n,) times at which poses are missing: between two of `times` (m,) that are more than MOST_STEPS steps apart.

    step_ns: usual time between poses.  Of a gap longer than LONGEST_GAP_NS only those at its beginning.
    """
    gaps = np.diff(times)
    found = [np.zeros(0, dtype=np.int64)]
    for k in np.flatnonzero(gaps > p.MOST_STEPS * step_ns):
        gap_ns = min(int(gaps[k]), p.LONGEST_GAP_NS)
        count = max(1, round(gap_ns / step_ns) - 1)
        found.append(times[k] + np.arange(1, count + 1) * gap_ns // (count + 1))
    return np.concatenate(found)


@dataclass(frozen=True)
class StretchPoses:
    """Poses of a stretch, n.  motion: (n, MOTION).  missing: number of missing ones.  lost: of each between samples that
    show the person."""

    rows: Sequence[PoseRow]
    motion: Floats
    missing: int
    lost: Sequence[bool]


def _stretch(
    evidence: TakeEvidence, span: tuple[int, int], poses: StretchPoses, samples: Sequence[SampleFigures], step_ns: float
) -> Stretch | None:
    """Figures of one stretch; None where the person is absent.  step_ns: usual time between poses."""
    rows, motion = poses.rows, poses.motion
    if any(sample.views for sample in samples):
        there = [sample for sample in samples if sample.seen or sample.posed]
        if not there:
            return None
        lost = float(np.mean([not sample.posed for sample in there]))
        lost = max(lost, float(np.mean(poses.lost or [False])))
    else:
        expected = max(1.0, (span[1] - span[0]) / step_ns)
        lost = min(1.0, max(0.0, 1.0 - sum(not row.lost for row in rows) / expected))
    views = _view_means(samples)
    apart = _apart_means(samples)
    seen = [sum(one.area > p.MIN_AREA for one in sample.views.values()) for sample in samples if sample.posed]
    known = [row for row in rows if not row.lost]
    limbs = [row.limbs for row in known]
    cameras = max(len(evidence.cameras), 2)
    values = {
        "outside": _largest([one.outside for one in views.values()]),
        "outside, all views": _mean([one.outside for one in views.values()]),
        "uncovered": _largest([one.uncovered for one in views.values()]),
        "uncovered, all views": _mean([one.uncovered for one in views.values()]),
        "apart": _largest([one.distance for one in apart.values()]),
        "feet apart": _largest([abs(one.feet) for one in apart.values()]),
        "cut": _mean([float(one.cut) for one in views.values()]), "hidden": _mean([one.hidden for one in views.values()]),
        "empty": 1.0 - _mean([count / cameras for count in seen]),
        "unused": 1.0 - _mean([row.used / cameras for row in known]),
        "limbs": 1.0 - _mean(np.ravel(limbs)), "worst limb": 1.0 - _mean([one.min() for one in limbs]),
        "heading": 1.0 - _mean([row.heading for row in known]), "lost": lost,
        "missing": (1.0 - lost) * poses.missing / max(1, len(rows) + poses.missing), "jumps": _mean(motion[:, 0]),
        "shaking": _mean(motion[:, 1]), "passes": _mean(motion[:, 2]), "limits": _mean(motion[:, 3]),
        "average body": float(not evidence.measured), "few views": 2.0 / cameras,
    }  # fmt: skip
    return Stretch(*span, np.array([values[name] for name in FEATURES]), views, apart, len(rows))


def _view_means(samples: Sequence[SampleFigures]) -> dict[str, ViewSample]:
    names = sorted({viewer for sample in samples for viewer in sample.views})
    found = {}
    for name in names:
        own = [sample.views[name] for sample in samples if name in sample.views]
        found[name] = ViewSample(
            outside=_mean([one.outside for one in own]), uncovered=_mean([one.uncovered for one in own]),
            area=_mean([one.area for one in own]), cut=_mean([float(one.cut) for one in own]) > 0.5,
            hidden=_mean([one.hidden for one in own]),
        )  # fmt: skip
    return found


def _apart_means(samples: Sequence[SampleFigures]) -> dict[str, Apart]:
    """By viewer, over its pairs and the samples."""
    own: dict[str, list[Floats]] = defaultdict(list)
    for sample in samples:
        for pair, (higher, feet, speed) in sample.apart.items():
            for viewer, sign in zip(pair, (1.0, -1.0), strict=True):
                moved = sign * higher * speed, speed**2
                own[viewer].append(np.array([np.abs(higher), sign * higher, sign * feet, higher**2, *moved]))
    return {viewer: Apart(*map(_mean, np.concatenate(every, axis=1))) for viewer, every in sorted(own.items())}


def _mean(values: Sequence[float] | Floats) -> float:
    """Mean of the known ones, NaN without any."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else float("nan")


def _largest(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return max(known, default=float("nan"))
