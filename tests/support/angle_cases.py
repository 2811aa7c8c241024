"""Poses and takes for the tests of joint angles: single joints turned, the simulated person walking."""

from pathlib import Path

import numpy as np

from tests.common.body.test_inverse_kinematics import body
from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.timeline import demo_timeline

WALKING_S = 7.0  # after the beginning of the demo's timeline
RATE = 30.0


def posed(anatomy: Anatomy, changes_deg: dict[str, float]) -> Floats:
    """Angles (1, angles) in radians of the neutral pose with some joint angles changed by degrees."""
    angles = anatomy.neutral.copy()
    for name, value in changes_deg.items():
        angles[anatomy.index[name]] += np.radians(value)
    return angles[None]


def track_of_angles(
    anatomy: Anatomy, positions: Floats, angles: Floats, *, rate: float = RATE, lost: tuple[int, ...] = ()
) -> PoseTrack:
    """A row for each frame from 0.  positions: (n, 3).  angles: (n, angles).  lost: rows without a pose."""
    count = len(positions)
    frames = np.arange(count, dtype=np.int64)
    gone = np.isin(frames, lost)[:, None]
    return PoseTrack(
        anatomy=anatomy, bdp=body(anatomy), frames=frames, times_s=frames / rate,
        positions=np.where(gone, np.nan, positions), angles=np.where(gone, np.nan, angles),
        scores={"1": np.ones(count)}, views={"1": ("facade",) * count},
        lost=tuple("person" if row else "" for row in gone[:, 0]), rate=rate,
    )  # fmt: skip


def walking_person(anatomy: Anatomy, count: int = 40, *, rate: float = RATE, lost: tuple[int, ...] = ()) -> PoseTrack:
    """True poses of the simulated person while walking."""
    subject = person(4)
    script = demo_timeline(subject, 0)
    points = [landmarks(subject, script.pose_at(WALKING_S + k / rate)) for k in range(count)]
    poses = poses_from_centres(anatomy, {name: np.array([one[name] for one in points]) for name in points[0]})
    positions, angles = np.array([pose.position for pose in poses]), np.array([pose.angles for pose in poses])
    return track_of_angles(anatomy, positions, angles, rate=rate, lost=lost)


def take_of(path: Path, track: PoseTrack) -> Path:
    """A take with the poses of a track: of the two-view method for ten parts, of the tracker for others."""
    if track.anatomy is TEN_PARTS:
        return write_take(path, messages_of_track(track))
    found: list[m.Message] = [messages_of_track(walking_like(track))[0]]
    found.append(m.TrackerBdp(frame=0, captured_ns=START_NS, body=body_of(track.anatomy, track.bdp)))
    for row, known in enumerate(track.known):
        angles = angles_by_name(track.anatomy, track.angles[row] if known else track.anatomy.neutral)
        x, y, z = track.positions[row] if known else np.zeros(3)
        found.append(
            built(
                m.TrackerPose, frame=int(track.frames[row]), captured_ns=START_NS + round(track.times_s[row] * 1e9),
                position=(x, y, z), angles=angles, spread=dict.fromkeys(angles, 0.0), lost=not known, views=["1"],
            )
        )  # fmt: skip
    return write_take(path, found)


def walking_like(track: PoseTrack) -> PoseTrack:
    """A ten-part track with the times of another, for its camera."""
    count = len(track.frames)
    return track_of_angles(TEN_PARTS, np.zeros((count, 3)), np.tile(TEN_PARTS.neutral, (count, 1)), rate=track.rate)
