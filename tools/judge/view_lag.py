"""Views out of step with the rest, from the silhouettes of a take.

The comparison is that of `zenocap sync`; its limits of certainty hold here too, but for the error of a lag.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from zenocap.common import messages as m
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import camera_of, silhouette_mask
from zenocap.common.lags.delays import limits_of, silhouette_lags
from zenocap.common.lags.pairs import VideoOffset
from zenocap.common.lags.tangents import Outline, outline_of
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.parameters import LAG_ERROR_S, LAG_ERRORS, LEAST_LAG_S, MOST_LAG_S


@dataclass(frozen=True)
class ViewLags:
    """views: lead of each view that is out of step over `others` (s), negative where it shows earlier moments."""

    views: Mapping[str, float]
    others: tuple[str, ...]

    @property
    def reason(self) -> m.VerdictReason:
        """The views with their lags, and what finds them exactly."""
        others = f"camera {self.others[0]}" if len(self.others) == 1 else "the others"
        parts = [
            f"camera {viewer} is about {abs(lag_s):.2f} s {'later' if lag_s > 0 else 'earlier'} than {others}"
            for viewer, lag_s in self.views.items()
        ]
        text = f"{'; '.join(parts)}: its video began at another time than its times say: zenocap sync; live, its clock"
        return m.VerdictReason(kind="views-apart", viewers=list(self.views), text=text)


def view_lags(evidence: TakeEvidence) -> ViewLags | None:
    """Views that are certainly out of step with the others; None without any.

    Those with which most others agree are in step; of two views alone it is the first.
    """
    outlines = outlines_of(evidence)
    if sum(len(one) > 2 for one in outlines.values()) < 2:
        return None
    cameras = {viewer: camera_of(info) for viewer, info in evidence.cameras.items() if viewer in outlines}
    found = silhouette_lags(cameras, outlines, replace(limits_of(MOST_LAG_S), error_s=LAG_ERROR_S))
    period_s = max(_period_s(outlines[viewer]) for viewer in cameras)
    return lags_of(found.certain, period_s)


def lags_of(offsets: Mapping[str, VideoOffset], period_s: float) -> ViewLags | None:
    """Lags against the views that agree within a frame period.  offsets: by view, certain ones."""
    if len(offsets) < 2:
        return None
    near = {
        viewer: tuple(other for other, its in offsets.items() if abs(its.offset_s - one.offset_s) <= period_s)
        for viewer, one in offsets.items()
    }
    others = max(near.values(), key=len)
    in_step_s = float(np.median([offsets[viewer].offset_s for viewer in others]))
    lags = {viewer: one.offset_s - in_step_s for viewer, one in offsets.items() if viewer not in others}
    least_s = max(period_s, LEAST_LAG_S)
    stated = {
        viewer: lag_s for viewer, lag_s in lags.items() if abs(lag_s) >= max(least_s, LAG_ERRORS * offsets[viewer].error_s)
    }
    return ViewLags(stated, others) if stated else None


def outlines_of(evidence: TakeEvidence) -> dict[str, list[Outline]]:
    """By view, the outlines of its first silhouettes, with times in seconds from the first of all views on."""
    kept = {viewer: every for viewer, every in evidence.beginnings.items() if viewer in evidence.cameras}
    start_ns = min((every[0].captured_ns for every in kept.values()), default=0)
    found: dict[str, list[Outline]] = {}
    for viewer, every in sorted(kept.items()):
        camera = camera_of(evidence.cameras[viewer])
        found[viewer] = []
        for silhouette in every:
            outline = seen_outline(camera, silhouette, start_ns)
            if outline is not None and (not found[viewer] or outline.time_s > found[viewer][-1].time_s):
                found[viewer].append(outline)
    return found


def seen_outline(camera: Camera, silhouette: m.Silhouette, start_ns: int = 0, least: float = 0.0) -> Outline | None:
    """Outline of a silhouette, with the time since start_ns; None of a damaged one or one of another size.

    None also of an area up to `least`, a share of the image.
    """
    try:
        mask = silhouette_mask(silhouette, camera.size)
    except ValueError:
        return None
    if np.count_nonzero(mask) <= least * mask.size:
        return None
    return outline_of(camera, mask, (silhouette.captured_ns - start_ns) / 1e9)


def _period_s(outlines: list[Outline]) -> float:
    steps = [later.time_s - one.time_s for one, later in pairwise(outlines)]
    return float(np.median(steps)) if steps else 0.0
