"""Distance of the poses of a rig from the simulated person that its cameras show."""

from contextlib import suppress

import numpy as np

from zenocap.common.body.kinematics import joint_centres
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.sources import Actor
from zenocap.services.animator.parameters import POSE_WAIT_NS
from zenocap.services.animator.states import AnimatorState
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.timeline import MotionTimeline, performance

DIGITS = 4  # after the point, metres


def simulated_motion(rig: Rig) -> MotionTimeline | None:
    """Motion of the person that all cameras show; None for a rig with other cameras."""
    source, *others = {viewer.source for viewer in rig.viewers}
    with suppress(ValueError):  # of an unknown name, which the viewers report
        return performance(source.name, source.seed) if isinstance(source, Actor) and not others else None
    return None


def distances(motion: MotionTimeline, state: AnimatorState) -> dict[str, float]:
    """Distance of the joint centres of each method's present pose from the person's at its capture time, mean, metres.

    Without a method that has lost the person, and without all while the scene is empty.
    """
    found: dict[str, float] = {}
    if state.start_ns is None:
        return found
    for source, actor in state.actors.items():
        time_s = (actor.captured_ns - state.start_ns) / 1e9
        present = state.now_ns - actor.received_ns < POSE_WAIT_NS and "person" not in actor.lost and time_s >= 0.0
        pose = motion.pose_at(time_s) if present else None
        if pose is not None:
            true = landmarks(motion.person, pose)
            named = zip(actor.anatomy.markers, joint_centres(actor.anatomy, actor.body, actor.pose), strict=True)
            offsets = [centre - true[marker.name] for marker, centre in named if marker.name in true]
            found[source] = round(float(np.linalg.norm(offsets, axis=1).mean()), DIGITS)
    return found
