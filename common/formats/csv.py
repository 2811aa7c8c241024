"""CSV: one row per frame with position, joint angles, scores and joint centres, for spreadsheets and notebooks."""

import csv
from math import degrees
from pathlib import Path

from common.formats.poses import Poses


def write_csv(path: Path, poses: Poses) -> None:
    """Metres, degrees, seconds since frame 0; the header names the unit.  Blank while the person is lost.

    Raises OSError.
    """
    viewers = sorted({viewer for bap in poses.baps for viewer in bap.scores} | set(poses.cameras))
    joints = poses.trajectories()
    header = ["frame", "time_s", *(f"navel.{axis}_m" for axis in "xyz")]
    header += [f"{name}_deg" for name in poses.anatomy.angles]
    header += [f"{what}.{viewer}" for viewer in viewers for what in ("view", "score")]
    header += [f"{name}.{axis}_m" for name in joints.names for axis in "xyz"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*header, "lost"])
        for bap, time_s, points in zip(poses.baps, poses.times_s, joints.points, strict=True):
            known = "person" not in bap.lost
            pose = poses.pose(bap)
            numbers = [*pose.position, *(degrees(angle) for angle in pose.angles)]
            seen = [cell for viewer in viewers for cell in (bap.views.get(viewer, ""), _score(bap.scores.get(viewer)))]
            row = [str(bap.frame), f"{time_s:.6f}", *(f"{value:.6f}" if known else "" for value in numbers), *seen]
            row += [f"{value:.6f}" if known else "" for value in points.ravel()]
            writer.writerow([*row, " ".join(bap.lost)])


def _score(score: float | None) -> str:
    return "" if score is None else f"{score:.4f}"
