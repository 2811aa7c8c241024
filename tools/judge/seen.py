"""Causes of lost poses in the pictures: two people, a scene that was not empty, half a person."""

from collections import defaultdict

import numpy as np

from zenocap.common import messages as m
from zenocap.common.camera_advice import sentence
from zenocap.common.messages import AdviceCode
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.parameters import OFTEN_HALF, OFTEN_SEEN, SAMPLE_NS, START_NS

KINDS = {AdviceCode.PEOPLE: "two-people", AdviceCode.UNCOVERED: "not-empty"}


def scene_reasons(evidence: TakeEvidence) -> list[m.VerdictReason]:
    """Other people, and scenes that were not empty, as the advice of the cameras states them."""
    found: dict[AdviceCode, list[str]] = defaultdict(list)
    words: dict[AdviceCode, str] = {}
    for one in evidence.advice.faults():
        if one.fault.code in KINDS and one.share >= OFTEN_SEEN:
            found[one.fault.code].append(one.viewer)
            words.setdefault(one.fault.code, sentence(one.fault))
    return [
        m.VerdictReason(
            kind=KINDS[code], viewers=sorted(viewers), text=f"camera {', '.join(sorted(viewers))}: {words[code]}"
        )
        for code, viewers in found.items()
    ]


def half_person(evidence: TakeEvidence) -> m.VerdictReason | None:
    """The upper or lower border of the image cuts the silhouettes so often that no two cameras see the whole person."""
    cut: dict[str, list[bool]] = defaultdict(list)
    for sample in evidence.samples.values():
        for viewer, one in sample.silhouettes.items():
            if one.data:
                _, top, _, height = one.region
                cut[viewer].append(top == 0 or top + height >= one.size[1])
    often = sorted(viewer for viewer, every in cut.items() if np.mean(every) > OFTEN_HALF)
    if not often or len(cut) - len(often) >= 2:
        return None
    text = (
        f"half of the person is outside the pictures: the upper or lower border cuts the silhouettes of camera "
        f"{', '.join(often)}: two cameras or more must see the whole person, from the head to the feet"
    )
    return m.VerdictReason(kind="half-person", viewers=often, text=text)


def no_pose(evidence: TakeEvidence) -> list[m.VerdictReason]:
    """Reasons of a take without poses, the causes first."""
    half = half_person(evidence)
    causes = [*scene_reasons(evidence), *([] if half is None else [half])]
    seen_s = (
        SAMPLE_NS / 1e9 * sum(any(one.data for one in sample.silhouettes.values()) for sample in evidence.samples.values())
    )
    if evidence.body is None and 0.0 < seen_s <= START_NS / 1e9:
        text = (
            f"no pose: a person is in view for some {seen_s:.1f} s only, and tracking starts after 1.2 s, or in the "
            "T-pose: a longer recording, with the person in view of two cameras or more"
        )
    elif evidence.body is None and evidence.cameras and not causes:
        text = (
            "no pose: no person was found that two cameras or more see at a time: the empty scene (empty_seconds), the "
            "calibration, swapped videos, and for two-view the T-pose"
        )
    else:
        text = "no pose"
    return [*causes, m.VerdictReason(kind="no-pose", viewers=[], text=text)]
