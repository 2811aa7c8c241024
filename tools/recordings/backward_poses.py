"""The backward pass over a take, and the poses of both directions by capture time."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from zenocap.common.body.definition import Bdp
from zenocap.common.session.lookahead import Lookahead
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.both_ways.backward import (
    Backward,
    Decided,
    are_opposite,
    begin,
    evidence_in,
    step_back,
)
from zenocap.services.tracker.both_ways.fusion import CHOICES, TwoPoses, two_poses
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.parameters import MIN_VIEWS
from zenocap.services.tracker.states import Setup
from zenocap.services.tracker.tracking import rooted_pose
from zenocap.tools.recordings.backward_scenes import ForwardPose, SceneMasks


def two_poses_of(
    setup: Setup,
    body: Bdp,
    backwards: Iterable[SceneMasks],
    watch: Callable[[int], None],
    lookahead: Lookahead,
    decided: Decided,
) -> dict[int, TwoPoses]:
    """Poses of both directions by capture time; the backward pass begins with the first of `backwards`."""
    model = model_of(setup.anatomy, body)
    seen = lookahead.ahead(_seen(setup, backwards))
    found: dict[int, TwoPoses] = {}
    poses = lookahead.ahead(_backward_poses(setup, body, seen, decided))
    for count, (captured_ns, ahead, back, evidence) in enumerate(poses, 1):
        if evidence is not None:
            two = two_poses(setup.anatomy, model, captured_ns, ahead, back, evidence)
        else:
            two = None if ahead is None else TwoPoses(captured_ns, ahead, None, np.zeros(CHOICES))
        if two is not None:
            found[captured_ns] = two
        watch(count)
    return found


def _seen(setup: Setup, backwards: Iterable[SceneMasks]) -> Iterator[tuple[ForwardPose, Evidence | None]]:
    """Yield the poses with their evidence, None where too few views have a mask."""
    for one, masks in backwards:
        yield one, None if len(masks) < MIN_VIEWS else evidence_in(setup, masks)


def _backward_poses(
    setup: Setup, body: Bdp, seen: Iterable[tuple[ForwardPose, Evidence | None]], decided: Decided
) -> Iterator[tuple[int, RootedPose | None, RootedPose | None, Evidence | None]]:
    """Yield capture time, forward and backward pose, None where there is none, and evidence of each frame set."""
    state: Backward | None = None
    for one, evidence in seen:
        ahead = None if one.lost else rooted_pose(setup, body, one.pose)
        back: RootedPose | None = None
        if evidence is not None and state is None and not one.lost:
            state, back = begin(setup, body, one.pose, one.captured_ns, evidence), ahead
        elif evidence is not None and state is not None:
            state, back = step_back(setup, state, one.captured_ns, evidence)
            if ahead is not None and back is not None and decided.passed(one.captured_ns) and are_opposite(ahead, back):
                state, back = begin(setup, body, one.pose, one.captured_ns, evidence), ahead
        yield one.captured_ns, ahead, back, evidence
