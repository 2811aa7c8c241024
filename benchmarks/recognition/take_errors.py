"""Errors of the poses in a generated take against the person's true poses, frame by frame."""

from math import ceil
from pathlib import Path

from benchmarks.errors import FrameError, estimate_of, frame_error
from zenocap.common.formats.take_poses import read_poses
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.tools.dataset.batch import PostureTake
from zenocap.tools.dataset.generate import FPS


def take_errors(path: Path, take: PostureTake) -> list[FrameError]:
    """Errors of every frame from the start of the posture on, infinite without a pose, with the take's last body.

    path: of the take, which does not exist when it has no pose.
    """
    timeline, subject = take.timeline(), person(take.person)
    found = {}
    if path.is_file():
        track = read_poses(path).track()
        known = zip(track.frames.tolist(), track.known.tolist(), strict=True)
        found = {
            frame: estimate_of(track.anatomy, track.bdp, track.pose(row)) for row, (frame, is_known) in enumerate(known)
            if is_known
        }  # fmt: skip
    errors = []
    for frame in range(ceil(timeline.motion_from_s * FPS), int(timeline.duration_s * FPS)):
        pose = timeline.pose_at(frame / FPS)
        assert pose is not None, "the person is in the scene from the T-pose on"
        errors.append(frame_error(found.get(frame), truth(subject, pose)))
    return errors
