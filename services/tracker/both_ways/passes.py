"""The second pass over frame sets, and the better poses of both passes by capture time."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.session.lookahead import Lookahead, limited_threads
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.both_ways.backward import Backward, Decided, begin, evidence_in, step_back, with_fixed_body
from zenocap.services.tracker.both_ways.fusion import CHOICES, SECTIONS, TwoPoses, fused, two_poses
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.confidence import Confidence
from zenocap.services.tracker.initialization.decisions import faces
from zenocap.services.tracker.parameters import MIN_VIEWS
from zenocap.services.tracker.states import TrackerSetup

BACKWARDS, CHOOSING = "tracking backwards", "choosing the better poses"
Watch = Callable[[str, int, int], None]  # called with the activity, the number of poses done, and of all


@dataclass(frozen=True, slots=True)
class ForwardPose:
    """Pose of the forward pass.  views: the viewers that it used.  confidence: None where it is unknown."""

    captured_ns: int
    pose: Pose
    lost: bool
    views: tuple[str, ...]
    confidence: Confidence | None = None


SceneMasks = tuple[ForwardPose, Mapping[str, Mask]]  # masks: by viewer, (height, width), not 0 on the person


@dataclass(frozen=True, slots=True)
class FusedPose:
    """Pose from both directions.  shares: (sections,) of the backward pass.  lost: in both directions.

    confidence: of the backward pass, None where it is that of the forward pass.
    """

    pose: Pose
    shares: Floats
    lost: bool = False
    confidence: Confidence | None = None


def two_passes(
    setup: TrackerSetup, body: Bdp, forward: Sequence[ForwardPose], backwards: Iterable[SceneMasks],
    watch: Watch = lambda *_: None, jobs: int = 1,
) -> Mapping[int, FusedPose]:  # fmt: skip
    """Poses from both directions by capture time, one for each of the forward pass.

    forward: by capture time.  backwards: poses with the masks that they used, from the last tracked one to the first.
    watch: called with the progress.  jobs: number of cores to use, on which the poses do not depend.
    """
    decided = Decided.of(setup, next(one.captured_ns for one in forward if not one.lost))
    with limited_threads(jobs), Lookahead(jobs) as lookahead:
        both = _both_poses(
            with_fixed_body(setup), body, backwards, lambda done: watch(BACKWARDS, done, len(forward)), lookahead, decided
        )
    watch(CHOOSING, 0, len(forward))
    result: dict[int, FusedPose] = {}
    stretch: list[TwoPoses] = []
    last = next(one.pose for one in forward if not one.lost)
    for one in (*forward, None):
        two = both.pop(one.captured_ns, None) if one is not None else None
        if two is not None:
            stretch.append(two)
            continue
        if stretch:
            watch(CHOOSING, len(result), len(forward))
            for ended, (rooted, shares) in zip(stretch, fused(setup.anatomy, stretch, setup.frame_ns), strict=True):
                last = rooted.pose(setup.anatomy)
                result[ended.captured_ns] = FusedPose(last, shares, confidence=ended.back)
            stretch = []
        if one is not None:  # lost in both directions: the last pose, as the tracker does
            result[one.captured_ns] = FusedPose(last, np.zeros(len(SECTIONS)), lost=True)
    return result


def _both_poses(
    setup: TrackerSetup, body: Bdp, backwards: Iterable[SceneMasks], watch: Callable[[int], None], lookahead: Lookahead,
    decided: Decided,
) -> dict[int, TwoPoses]:  # fmt: skip
    """Poses of both directions by capture time; the backward pass begins with the first of `backwards`."""
    model = model_of(setup.anatomy, body)
    seen = lookahead.ahead(_seen(setup, backwards))
    found: dict[int, TwoPoses] = {}
    poses = lookahead.ahead(_backward_poses(setup, body, seen, decided))
    for count, (one, ahead, back, evidence, confidence) in enumerate(poses, 1):
        captured_ns = one.captured_ns
        if evidence is not None:
            two = two_poses(setup.anatomy, model, captured_ns, ahead, back, evidence, (one.confidence, confidence))
        else:
            two = None if ahead is None else TwoPoses(captured_ns, ahead, None, np.zeros(CHOICES))
        if two is not None:
            found[captured_ns] = two
        watch(count)
    return found


def _seen(setup: TrackerSetup, backwards: Iterable[SceneMasks]) -> Iterator[tuple[ForwardPose, Evidence | None]]:
    """Yield the poses with their evidence, None where too few views have a mask."""
    for one, masks in backwards:
        yield one, None if len(masks) < MIN_VIEWS else evidence_in(setup, masks)


def _backward_poses(
    setup: TrackerSetup, body: Bdp, seen: Iterable[tuple[ForwardPose, Evidence | None]], decided: Decided
) -> Iterator[tuple[ForwardPose, RootedPose | None, RootedPose | None, Evidence | None, Confidence | None]]:
    """Yield each frame set with its forward and backward pose, None where there is none, evidence and confidence."""
    state: Backward | None = None
    for one, evidence in seen:
        ahead = None if one.lost else RootedPose.of(setup.anatomy, body, one.pose)
        back: RootedPose | None = None
        if evidence is not None and state is None and not one.lost:
            heading = None if one.confidence is None or decided.passed(one.captured_ns) else one.confidence.heading
            state, back = begin(setup, body, one.pose, one.captured_ns, evidence, heading), ahead
        elif evidence is not None and state is not None:
            state, back = step_back(setup, state, one.captured_ns, evidence)
            if (
                ahead is not None
                and back is not None
                and decided.passed(one.captured_ns)
                and not faces(ahead, back.rotation[:, 2])
            ):
                state, back = begin(setup, body, one.pose, one.captured_ns, evidence), ahead
        yield one, ahead, back, evidence, None if state is None else state.confidence
