"""Motions for the tests of exported scenes: a skeleton with its skin."""

from zenocap.common.formats.animated_skeleton import AnimatedSkeleton, animated_skeleton
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.tools.takes.export import skin_of


def motion_of(track: PoseTrack) -> AnimatedSkeleton:
    return animated_skeleton(track, skin_of(track.anatomy, track.bdp))
