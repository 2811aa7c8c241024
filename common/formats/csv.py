"""CSV export: one row per frame with position, joint angles, scores and joint centres."""

import csv
from pathlib import Path

import numpy as np

from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.joint_conventions import Convention
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import DIGITS, Angle, Axes, Unit, convert


def write_csv(
    path: Path,
    track: PoseTrack,
    *,
    axes: Axes = "y-up",
    unit: Unit = "m",
    angle: Angle = "deg",
    joints: Convention = "zenocap",
    min_confidence: float = 0.0,
    spine: bool = False,
) -> None:
    """Write a CSV file: time in seconds since frame 0, units in the headings, blank cells while the person is lost.

    axes, unit: of position and joint centres.  joints: convention of the joint centres, those of a limb below
    min_confidence are blank.  spine: with the joints of the spine.
    Joint angles are the model's, the navel's relative to the Y-up world.
    Raises OSError.
    """
    centres = track.trajectories(joints, min_confidence, spine=spine)
    header = ["frame", "time_s", *(f"navel.{axis}_{unit}" for axis in "xyz")]
    header += [f"{name}_{angle}" for name in track.anatomy.angles]
    header += [f"{name}.{viewer}" for viewer in track.views for name in ("view", "score")]
    header += [f"{name}.{axis}_{unit}" for name in centres.names for axis in "xyz"]
    positions, points = convert(track.positions, axes, unit), convert(centres.points, axes, unit)
    angles = np.degrees(track.angles) if angle == "deg" else track.angles
    digits = DIGITS[unit]
    with atomic_file(path) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*header, *(f"confidence.{limb}" for limb in track.limbs), "lost"])
        for row, (frame, time_s) in enumerate(zip(track.frames, track.times_s, strict=True)):
            cells = [str(int(frame)), f"{time_s:.6f}"]
            cells += [_number(value, digits) for value in positions[row]]
            cells += [_number(value, 6) for value in angles[row]]
            for viewer, views in track.views.items():
                cells += [views[row], _number(track.scores[viewer][row], 4)]
            cells += [_number(value, digits) for value in points[row].ravel()]
            cells += [_number(confidence[row], 4) for confidence in track.limbs.values()]
            writer.writerow([*cells, track.lost[row]])


def _number(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def export(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_csv(
        path, request.track, axes=request.axes, unit=request.unit, angle=request.angle, joints=request.joints,
        min_confidence=request.min_confidence, spine=request.spine,
    )  # fmt: skip
