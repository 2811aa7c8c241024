"""Causes of lost poses in the pictures: people, scene not empty, half a person, contrast, legs."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Ints
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera_advice import sentence
from zenocap.common.conversion import camera_of, silhouette_mask
from zenocap.common.lags.tangents import Outline, scene_centre
from zenocap.common.messages import AdviceCode
from zenocap.tools.judge import parameters as p
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.view_lag import seen_outline

KINDS = {AdviceCode.PEOPLE: "two-people", AdviceCode.UNCOVERED: "not-empty"}
LEFT_OUT = {AdviceCode.OCCUPIED: "not-empty"}  # images that were not learnt: after what is certain, and last if few


def scene_reasons(
    evidence: TakeEvidence, kinds: Mapping[AdviceCode, str] = KINDS, least: float = 0.0
) -> list[m.VerdictReason]:
    """Other people, and scenes that were not empty, as the advice of the cameras states them.  least: value of a fault."""
    found: dict[AdviceCode, list[str]] = defaultdict(list)
    words: dict[AdviceCode, str] = {}
    for one in evidence.advice.faults():
        if one.fault.code in kinds and one.share >= p.OFTEN_SEEN and one.fault.value >= least:
            found[one.fault.code].append(one.viewer)
            words.setdefault(one.fault.code, sentence(one.fault))
    return [
        m.VerdictReason(
            kind=kinds[code], viewers=sorted(viewers), text=f"camera {', '.join(sorted(viewers))}: {words[code]}"
        )
        for code, viewers in found.items()
    ]


def half_person(evidence: TakeEvidence) -> m.VerdictReason | None:
    """A thing often cuts the silhouettes of all cameras: above they end in a straight line that stays.  Or, without poses,
    the border of the image cuts them so often that no two cameras see the whole person."""
    rows = _row_widths(evidence)
    cut = {viewer: [bool(one[0] or one[-1]) for one in every] for viewer, every in rows.items() if not evidence.poses}
    lines = {viewer: _straight(every) for viewer, every in rows.items()}
    for how, signs, but in (
        ("outside the pictures: the upper or lower border cuts the silhouettes of camera {}", cut, 1),
        ("covered: a straight line that stays, as of a table or a wall, cuts the silhouettes of camera {} above", lines, 0),
    ):
        if often := _most({viewer: float(np.mean(every)) for viewer, every in signs.items()}, p.OFTEN_HALF, but):
            text = f"half of the person is {how.format(', '.join(often))}: two cameras or more must see head and feet"
            return m.VerdictReason(kind="half-person", viewers=often, text=text)
    return None


def _straight(every: Sequence[Ints]) -> Bools:
    """(n,) whether the upper end is where it mostly is, and wide just below.  every: (height,) widths of rows, n."""
    tops = np.array([np.flatnonzero(one)[0] / len(one) for one in every])
    rows = [np.trim_zeros(one) for one in every]
    wide = np.array([one[len(one) // p.LINE_PART] >= p.LINE_WIDE * np.median(one[one > 0]) for one in rows])
    return np.asarray(wide & (np.abs(tops - np.median(tops)) <= p.LINE_STAYS), dtype=np.bool_)


def unsteady(evidence: TakeEvidence) -> m.VerdictReason | None:
    """Silhouettes whose area changes more than that of a person who moves; None where two views or more are steady."""
    areas = {viewer: np.log([one.sum() for one in every]) for viewer, every in _row_widths(evidence).items()}
    changes = {viewer: float(np.mean(np.abs(np.diff(own)))) for viewer, own in areas.items() if len(own) > 1}
    if not (often := _most(changes, p.UNSTEADY)):
        return None
    text = (
        f"parts of the silhouettes of camera {', '.join(often)} come and go, in a quarter of a second the area changes by "
        f"a factor of {np.exp(max(changes.values())):.1f}: contrast of person and background, changing light, the empty "
        "scene (empty_seconds)"
    )
    return m.VerdictReason(kind="silhouettes", viewers=often, text=text)


def _most(shares: Mapping[str, float], limit: float, but: int = 1) -> list[str]:
    """Viewers of more than a limit; none where more than `but` have less."""
    often = sorted(viewer for viewer, share in shares.items() if share > limit)
    return often if len(shares) - len(often) <= but else []


def _row_widths(evidence: TakeEvidence) -> dict[str, list[Ints]]:
    """By viewer: (height,) pixels in each row of its silhouettes, in order of time, without empty ones."""
    found: dict[str, list[Ints]] = defaultdict(list)
    for _, sample in sorted(evidence.samples.items()):
        for viewer, one in sample.silhouettes.items():
            with suppress(ValueError):  # damaged
                if (widths := np.count_nonzero(silhouette_mask(one), axis=1)).any():
                    found[viewer].append(widths)
    return found


def no_legs(evidence: TakeEvidence) -> m.VerdictReason | None:
    """The silhouettes of a camera mostly end above the floor, although the cameras agree on the place of the head."""
    cameras = {viewer: camera_of(info) for viewer, info in evidence.cameras.items()}
    every = [one for _, one in sorted(evidence.samples.items()) if len(one.silhouettes) > 1]
    every = every[:: max(1, len(every) // p.MOST_HEADS)]
    ends: dict[str, list[float]] = defaultdict(list)
    agreed = people = 0
    for sample in every:
        seen = {
            viewer: seen_outline(cameras[viewer], one) for viewer, one in sample.silhouettes.items() if viewer in cameras
        }
        outlines = {viewer: one for viewer, one in seen.items() if one is not None}
        found = lower_ends(cameras, outlines)
        people, agreed = people + (len(outlines) > 1), agreed + bool(found)
        for viewer, height in found.items():
            ends[viewer].append(height)
    often = sorted(viewer for viewer, own in ends.items() if np.mean(np.array(own) > p.LEGS_ABOVE_M) > p.OFTEN_HALF)
    if not often or agreed < p.OFTEN_HALF * people:
        return None
    least = min(float(np.median(ends[viewer])) for viewer in often)
    text = (
        f"the legs are missing in the silhouettes of camera {', '.join(often)}, which end {least:.2f} m above the floor or "
        "more: contrast of legs and floor, something in front of them, the empty scene (empty_seconds), or a calibration "
        "whose Y = 0 is below the floor"
    )
    return m.VerdictReason(kind="no-legs", viewers=often, text=text)


def lower_ends(cameras: Mapping[str, Camera], outlines: Mapping[str, Outline]) -> dict[str, float]:
    """Height over the floor of the lower end of each silhouette, m, as far away as the head is.

    Empty where fewer than two views show the head, or do not agree on it, and where it is none of a person who stands or
    walks.  Left out: silhouettes whose lower end is at the border of the image.
    """
    slopes = {
        viewer: one.rays[:, 1] / np.maximum(np.hypot(one.rays[:, 0], one.rays[:, 2]), 1e-9)
        for viewer, one in outlines.items()
    }
    tops = {viewer: int(np.argmax(own)) for viewer, own in slopes.items()}
    heads = {viewer: outlines[viewer].rays[k] for viewer, k in tops.items() if not outlines[viewer].cut[k]}
    if len(heads) < 2:
        return {}
    rays = [[replace(outlines[viewer], rays=ray[None])] for viewer, ray in heads.items()]
    head = scene_centre([cameras[viewer] for viewer in heads], rays)
    apart = max(float(np.linalg.norm(np.cross(head - cameras[viewer].centre, ray))) for viewer, ray in heads.items())
    if apart > p.HEAD_APART_M or not p.HEADS_M[0] <= head[1] <= p.HEADS_M[1]:
        return {}
    found = {}
    for viewer, own in slopes.items():
        k, centre = int(np.argmin(own)), cameras[viewer].centre
        if not outlines[viewer].cut[k]:
            found[viewer] = float(centre[1] + own[k] * np.hypot(*(head - centre)[[0, 2]]))
    return {} if max(found.values(), default=0.0) > p.LEGS_MOST * head[1] else found
