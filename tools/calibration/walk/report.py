"""Report of a calibration from a walk: what each camera saw, what fits, what to do better."""

import math

from zenocap.tools.calibration.walk.calibration import WalkCalibration
from zenocap.tools.calibration.walk.parameters import GOOD_ERROR_M, LEAST_WIDTH_M, MOST_MRAD


def report(found: WalkCalibration) -> list[str]:
    """Lines of text."""
    lines = [
        f"compared at {found.instants} instants; the walk covers {found.area_m[0]:.1f} by {found.area_m[1]:.1f} m; scale "
        f"from a person of {found.stature_m:g} m"
    ]
    for one in found.cameras:
        x, y, z = one.camera.centre
        lines.append(
            f"{one.camera.name}: whole at {one.instants} instants, {one.off_px:.1f} px ({one.off_mrad:.1f} mrad) off, at "
            f"({x:.2f}, {y:.2f}, {z:.2f}) m"
        )
    pairs = ", ".join(f"{one} and {other} {px:.1f}" for (one, other), px in found.pairs_px.items() if not math.isnan(px))
    lines.append(f"silhouettes of pairs of cameras disagree, px: {pairs or 'no pair can be compared'}")
    lines.append(f"expected error in the walked area: {1e3 * found.error_m:.0f} mm, and 1 % by each 1 % of the stature")
    lines.append(
        "lenses are taken as given: with a focal length 10 % too long a camera is put 10 % too far away, unnoticed"
    )
    return lines


def verdict(found: WalkCalibration) -> tuple[str, list[str]]:
    """Good or poor, and what to do better, for people."""
    reasons = [
        f"{one.camera.name}: {one.off_mrad:.0f} mrad off, more than {MOST_MRAD:g}: is its lens right, are the videos in "
        "step, is anything else than the person in its silhouettes?"
        for one in found.cameras
        if not one.off_mrad <= MOST_MRAD
    ]
    for one in found.cameras:
        if not any(one.camera.name in pair and not math.isnan(px) for pair, px in found.pairs_px.items()):
            reasons.append(f"{one.camera.name}: its silhouettes cannot be compared with any other's")
    if not found.area_m[1] >= LEAST_WIDTH_M:
        reasons.append(
            f"the walk is {found.area_m[1]:.1f} m wide, less than {LEAST_WIDTH_M:g}: walk through the whole area, in "
            "curves, not along one line"
        )
    if not found.error_m <= GOOD_ERROR_M:
        reasons.append(
            f"the expected error is {1e3 * found.error_m:.0f} mm, more than {1e3 * GOOD_ERROR_M:.0f}: walk longer, half a "
            "minute or more"
        )
    return ("poor" if reasons else "good"), reasons


def report_data(found: WalkCalibration) -> dict[str, object]:
    """The content of report and verdict for JSON."""
    word, reasons = verdict(found)
    return {
        "verdict": word,
        "reasons": reasons,
        "instants": found.instants,
        "area_m": list(found.area_m),
        "stature_m": found.stature_m,
        "expected_error_m": found.error_m,
        "cameras": [
            {
                "name": one.camera.name,
                "position_m": one.camera.centre.tolist(),
                "instants": one.instants,
                "off_px": one.off_px,
                "off_mrad": one.off_mrad,
            }
            for one in found.cameras
        ],
    }
