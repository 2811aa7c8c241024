"""Poses of a clip tracked both ways, as by `zenocap track --both-ways`."""

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.hybrid.runs import Case, Film, Run, TrackedPath, scored, setup_of, track_clip
from zenocap.services.tracker.both_ways.passes import ForwardPose, SceneMasks, two_passes
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.states import Setup


def run_both_ways(clip: Film, case: Case, prior: Prior | None) -> Run:
    """Track the person both ways, and score the result; times and losses are those of the forward pass."""
    path = both_ways_path(clip, setup_of(clip, case, prior), track_clip(clip, case, prior))
    return scored(path, clip.truth, clip.motion_from + case.skipped)


def both_ways_path(clip: Film, setup: Setup, path: TrackedPath) -> TrackedPath:
    """The path with the poses of both directions, all with its last body.  path: of the forward pass, of all instants."""
    if not path.poses:
        return path
    body, pose = path.poses[max(path.poses)]
    instants = [one for one in clip.instants if one.captured_ns >= 0 and one.frame >= min(path.poses)]
    forward: list[ForwardPose] = []
    for instant in instants:
        lost = instant.frame not in path.poses
        pose = pose if lost else path.poses[instant.frame][1]
        forward.append(ForwardPose(instant.captured_ns, pose, lost, path.views[instant.frame]))
    last = max(k for k, one in enumerate(forward) if not one.lost)

    def backwards() -> Iterator[SceneMasks]:
        for one, instant in zip(forward[last::-1], instants[last::-1], strict=True):
            masks = clip.masks(instant, setup.cameras)
            yield one, {viewer: masks[viewer] for viewer in setup.cameras if viewer in one.views}

    found = two_passes(setup, body, forward, backwards())
    poses = {
        instant.frame: (body, found[instant.captured_ns].pose)
        for instant in instants
        if not found[instant.captured_ns].lost
    }
    return replace(path, poses=poses)
