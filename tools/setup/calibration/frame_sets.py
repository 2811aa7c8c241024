"""Choice of the frame sets of the bundle adjustment."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.tools.setup.calibration.board_views import CameraViews, View
from zenocap.tools.setup.calibration.parameters import MAX_OWN, MAX_SHARED, PAIRED_PERIODS, RESTING_PX, SLOW_PX_S
from zenocap.tools.setup.calibration.rig_start import BoardFrameSet


def chosen_frame_sets(
    seen: Sequence[CameraViews], delays: Floats, max_shared: int = MAX_SHARED, max_own: int = MAX_OWN
) -> list[BoardFrameSet]:
    """Frame sets, by time, that cover the images of all cameras and pairs; slow motion first.

    delays: (cameras,) s, of each camera's images against their times.
    """
    candidates = _distinct(_candidates(seen, delays))
    shared = [one for one in candidates if len(one.views) > 1]
    chosen = _spread(seen, shared, max_shared)
    used = {id(view) for frame_set in chosen for view in frame_set.views.values()}
    for number, camera in enumerate(seen):
        own = [BoardFrameSet(view.time_s, {number: view}) for view in camera.views if usable(view) and id(view) not in used]
        chosen += _spread(seen, _distinct(own), max_own)
    return sorted(chosen, key=lambda frame_set: frame_set.time_s)


def frame_sets_near(
    seen: Sequence[CameraViews], delays: Floats, time_s: float, span_s: float, count: int
) -> list[BoardFrameSet]:
    """Up to `count` frame sets within `span_s` of a time, evenly spread, those with most cameras."""
    near = [one for one in _candidates(seen, delays) if abs(one.time_s - time_s) < span_s]
    most = max((len(one.views) for one in near), default=0)
    best = [one for one in near if len(one.views) == most]
    return [best[k] for k in sorted({round(k * (len(best) - 1) / max(1, count - 1)) for k in range(count)})] if best else []


def _distinct(candidates: Sequence[BoardFrameSet]) -> list[BoardFrameSet]:
    """The candidates, by time, without those in which the board rests where it was: equal views would outweigh others."""
    last: dict[int, View] = {}
    kept = []
    for frame_set in sorted(candidates, key=lambda one: one.time_s):
        moved = (k not in last or moved_px(last[k], view) > RESTING_PX for k, view in frame_set.views.items())
        if any(moved):
            kept.append(frame_set)
            last |= frame_set.views
    return kept


def distinct_views(views: Sequence[View]) -> list[View]:
    """The views of a camera without those in which the board rests where it was."""
    return [one.views[0] for one in _distinct([BoardFrameSet(view.time_s, {0: view}) for view in views])]


def moved_px(before: View, view: View) -> float:
    """Mean distance between the common corners of two views; infinite without common ones."""
    _, old, new = np.intersect1d(before.ids, view.ids, return_indices=True)
    return float(np.hypot(*(view.pixels[new] - before.pixels[old]).T).mean()) if len(old) else float("inf")


def usable(view: View) -> bool:
    """Whether the speed of the corners is known."""
    return not bool(np.isnan(view.velocities).any())


def shared_counts(seen: Sequence[CameraViews], delays: Floats) -> dict[tuple[int, int], int]:
    """Number of moments, frame periods apart, at which both cameras of a pair, by number, saw the board."""
    counts = {(one, other): 0 for one in range(len(seen)) for other in range(one + 1, len(seen))}
    for frame_set in _candidates(seen, delays):
        for pair in counts:
            counts[pair] += set(pair) <= set(frame_set.views)
    return counts


def _candidates(seen: Sequence[CameraViews], delays: Floats) -> list[BoardFrameSet]:
    """Moments on a grid of frame periods, each with the nearest view of each camera within about half a period."""
    kept = [[view for view in camera.views if usable(view)] for camera in seen]
    times = [np.array([view.time_s for view in views]) + delay for views, delay in zip(kept, delays, strict=True)]
    step = max(camera.period_s for camera in seen)
    if not any(len(one) for one in times):
        return []
    begin, end = min(one[0] for one in times if len(one)), max(one[-1] for one in times if len(one))
    found = []
    for k in range(round((end - begin) / step) + 1):
        time_s = begin + k * step
        views = {}
        for number, camera in enumerate(seen):
            if len(kept[number]) == 0:
                continue
            nearest = int(np.abs(times[number] - time_s).argmin())
            if abs(times[number][nearest] - time_s) <= PAIRED_PERIODS * camera.period_s:
                views[number] = kept[number][nearest]
        if views:
            found.append(BoardFrameSet(time_s, views))
    return found


def _spread(seen: Sequence[CameraViews], candidates: Sequence[BoardFrameSet], count: int) -> list[BoardFrameSet]:
    """Up to `count` candidates, each the one that adds the most cells and pairs that are still rarely covered."""
    if len(candidates) <= count:
        return list(candidates)
    cells = len(candidates[0].views[next(iter(candidates[0].views))].cells((1, 1)))
    cameras = len(seen)
    features = np.zeros((len(candidates), cameras * cells + cameras * cameras))
    slowness = np.ones(len(candidates))
    for k, frame_set in enumerate(candidates):
        for number, view in frame_set.views.items():
            features[k, number * cells : (number + 1) * cells] = view.cells(seen[number].size)
            slowness[k] = min(slowness[k], 1.0 / (1.0 + view.speed / SLOW_PX_S))
            for other in frame_set.views:
                if other > number:
                    features[k, cameras * cells + number * cameras + other] = 4.0
    counts = np.zeros(features.shape[1])
    chosen: list[int] = []
    for _ in range(count):
        gains = features @ (1.0 / (1.0 + counts)) * slowness
        gains[chosen] = -1.0
        chosen.append(int(gains.argmax()))
        counts += features[chosen[-1]]
    return [candidates[k] for k in sorted(chosen)]
