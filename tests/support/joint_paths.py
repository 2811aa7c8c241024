"""Paths of the simulated person's joints."""

from collections.abc import Mapping

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import Motion
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.timeline import MotionTimeline

STEP_S = 0.02


def joint_paths(
    subject: Person, motion: Motion | MotionTimeline, from_s: float = 0.0, to_s: float | None = None, step_s: float = STEP_S
) -> dict[str, Floats]:
    """(frames, 3) of every landmark, metres; to the end of the motion unless given."""
    times = np.arange(from_s, motion.duration_s if to_s is None else to_s, step_s)
    frames = [landmarks(subject, motion.pose_at(float(t))) for t in times]
    return {name: np.array([frame[name] for frame in frames]) for name in frames[0]}


def top_speed(paths: Mapping[str, Floats], step_s: float = STEP_S) -> float:
    """Of the fastest one, metres per second."""
    return max(float(np.linalg.norm(np.diff(path, axis=0), axis=1).max()) for path in paths.values()) / step_s
