"""World of a calibrated rig: floor of the board, or a vertical guessed from the cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.parameters import FLOOR_S, FLOOR_STILL_PX_S, ROLL_DEG
from zenocap.tools.setup.calibration.rig_start import BoardFrameSet, Pose

TILT_ALIKE_DEG = 3.0  # greatest difference of the board's places on the floor


@dataclass(frozen=True)
class World:
    """A Y-up world.  pose: from the frame of the adjustment.  known: whether the board lay on the floor.

    remarks: what is guessed, or contradicts, in words.
    """

    pose: Pose
    known: bool
    remarks: tuple[str, ...]


def at_floor(frame_sets: Sequence[BoardFrameSet], time_s: float) -> list[int]:
    """Numbers of the frame sets near a time at which the board lay on the floor.  Raises UserError without any."""
    near = [k for k, one in enumerate(frame_sets) if abs(one.time_s - time_s) <= FLOOR_S]
    if frame_sets and not near:
        begin, end = frame_sets[0].time_s, frame_sets[-1].time_s
        seen = f"it is seen from {begin:.1f} to {end:.1f} s, with gaps"
        raise UserError(f"--floor {time_s:g}: the board is not seen within {FLOOR_S:g} s: {seen}")
    return near


def floor_world(
    board: Board, frame_sets: Sequence[BoardFrameSet], boards: Sequence[Pose], times_s: Sequence[float]
) -> World:
    """The world whose floor the board lay on: origin in the middle of the board, X along its rows, Z down its columns.

    times_s: when the board lay on the floor; at several places the floor is the plane through all.  Raises UserError.
    """
    corners, ups, first = [], [], None
    for time_s in times_s:
        near = at_floor(frame_sets, time_s)
        speeds = [view.speed for k in near for view in frame_sets[k].views.values()]
        if float(np.median(speeds)) > FLOOR_STILL_PX_S:
            raise UserError(
                f"--floor {time_s:g}: the board moves there, by {np.median(speeds):.0f} px/s: allowed: a time at which it "
                "lies on the floor"
            )
        for k in near:
            rotation, shift = boards[k]
            corners.append(board.corners @ rotation.T + shift)
            ups.append(-rotation[:, 2])
            first = boards[k] if first is None else first
    assert first is not None
    points = np.concatenate(corners)
    up = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][2]
    up = up * np.sign(up @ np.mean(ups, axis=0))
    tilts = np.degrees(np.arccos(np.clip(np.array(ups) @ up, -1.0, 1.0)))
    remarks: tuple[str, ...] = ()
    if tilts.max() > TILT_ALIKE_DEG:
        remarks = (f"the board lies tilted by up to {tilts.max():.0f} degrees to the floor: is --floor right?",)
    origin = first[0] @ board.middle + first[1]
    origin = origin - up * (up @ (origin - points.mean(axis=0)))
    return World(_world(up, first[0][:, 0], origin), True, remarks)


def guessed_world(board: Board, cameras: Sequence[Pose], boards: Sequence[Pose]) -> World:
    """The world whose vertical is at a right angle to the rows of all images, and whose floor is the lowest seen corner."""
    rows = np.array([rotation[0] for rotation, _ in cameras])
    ups = -np.array([rotation[1] for rotation, _ in cameras])
    sizes, axes = np.linalg.svd(rows)[1:]
    up = axes[2] * np.sign(axes[2] @ ups.mean(axis=0) or 1.0)
    if len(cameras) < 2 or sizes[1] < 0.3:  # all look the same way: their tilt is not known
        up = ups.mean(axis=0) / np.linalg.norm(ups.mean(axis=0))
    rolls = np.degrees(np.abs(np.arcsin(np.clip(rows @ up, -1.0, 1.0))))
    points = np.concatenate([board.corners @ rotation.T + shift for rotation, shift in boards])
    middle = points.mean(axis=0)
    origin = middle - up * float(np.max((middle - points) @ up))
    remarks = [
        "the floor is not known: lay the board on it and give --floor SECONDS; guessed: no camera is rolled, and Y = 0 at "
        "the lowest place of the board"
    ]
    if rolls.max() > ROLL_DEG:
        remarks.append(f"a camera is rolled by {rolls.max():.0f} degrees against that vertical")
    return World(_world(up, rows[0], origin), False, tuple(remarks))


def _world(up: Floats, along: Floats, origin: Floats) -> Pose:
    """Pose of the frame with Y = `up` and X nearest to `along`, at `origin`."""
    x = along - up * (up @ along)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, up, np.cross(x, up)])
    return rotation, -rotation @ origin
