"""Planes of thigh and shank by a marker beside the segment's line."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import perpendicular, unit
from zenocap.common.formats.file_warnings import warn_of_file

LEAST_WAND_M = 0.015  # of the marker of thigh or shank from the line of the segment, to give its plane; chosen by hand
# Largest median error of a file, mm, of the centres of knees and ankles without and with the markers that give the
# plane, from those that Plug-in Gait wrote into five public C3D files.
WITHOUT_PLANE_MM = {"knee": (104, 21), "ankle": (98, 14)}
PLANES = (("knee", "thigh", "THI", "KNM"), ("ankle", "shank", "TIB", "MED"))  # joint, its wand, their names, medial


def from_wand(at: Mapping[str, Floats], side: str, wand: str, joint: str, start: Floats, otherwise: Floats) -> Floats:
    """Directions (n, 3) inwards in the plane of the segment with its marker, away from that; without one, `otherwise`.

    start: (n, 3) of the segment.  `otherwise` also where the marker is nearly in line with the segment.
    """
    beside = _beside(at, side, wand, joint, start)
    return otherwise if beside is None else -beside


def _beside(at: Mapping[str, Floats], side: str, wand: str, joint: str, start: Floats) -> Floats | None:
    """(n, 3) of the marker of thigh or shank from the line of the segment; None without one, or nearly in line."""
    if f"{side}{wand}" not in at:
        return None
    lateral = at[f"{side}{joint}"]
    beside = perpendicular(at[f"{side}{wand}"] - lateral, unit(lateral - start))
    return beside if float(np.median(np.linalg.norm(beside, axis=1))) >= LEAST_WAND_M else None


def warn_of_planes(at: Mapping[str, Floats], found: Mapping[str, Floats], path: Path) -> None:
    """Warn of knees and ankles whose plane no marker gives.

    at: markers (n, 3) as in `optical_markers.markers_of`.  found: centres (n, 3) by HALPE name.  path: of the file.
    """
    parts = []
    for (joint, wand, own, medial), above in zip(PLANES, ("Hip", "Knee"), strict=True):
        open_sides = [
            side
            for side in "LR"
            if f"{side}{joint}_medial" not in at and _beside(at, side, wand, joint, found[f"{side}{above}"]) is None
        ]
        if open_sides:
            missing = ", ".join(f"{side}{own} or {side}{medial}" for side in open_sides)
            without, usual = WITHOUT_PLANE_MM[joint]
            parts.append(f"no {missing}: {joint}s up to {without} mm off instead of {usual}")
    if parts:
        warn_of_file(
            path,
            "markers on thigh, shank or the inner side are missing or in line with the joints, so knees and ankles are "
            f"placed by the bend of the legs: {'; '.join(parts)} (medians of five public files)",
        )
