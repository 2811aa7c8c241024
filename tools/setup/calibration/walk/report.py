"""Report of a calibration from a walk: what each camera saw, what fits, what to do better."""

import math

from zenocap.tools.setup.calibration.walk import parameters as p
from zenocap.tools.setup.calibration.walk.calibration import WalkCalibration


def report(found: WalkCalibration) -> list[str]:
    lines = [
        f"{found.instants} frame sets compared; the walk covers {found.area_m[0]:.1f} by {found.area_m[1]:.1f} m; scale "
        f"from a person of {found.stature_m:g} m"
    ]
    for one in found.cameras:
        x, y, z = one.camera.centre
        lines.append(
            f"{one.camera.name}: whole in {one.instants} frame sets, {one.off_px:.1f} px ({one.off_mrad:.1f} mrad) off, at "
            f"({x:.2f}, {y:.2f}, {z:.2f}) m"
        )
    if found.delays:
        late = ", ".join(
            f"{name} {1e3 * one.seconds:+.0f} ± {1e3 * one.error_s:.0f}{'' if one.is_certain else ' (taken as 0)'}"
            for name, one in list(found.delays.items())[1:]
        )
        lines.append(f"images later than their times, against {next(iter(found.delays))}, ms: {late}")
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
        f"{one.camera.name}: {one.off_mrad:.0f} mrad off, more than {p.MOST_MRAD:g}: is its lens right, are the videos in "
        "step, is anything else than the person in its silhouettes?"
        for one in found.cameras
        if not one.off_mrad <= p.MOST_MRAD
    ]
    for one in found.cameras:
        if not any(one.camera.name in pair and not math.isnan(px) for pair, px in found.pairs_px.items()):
            reasons.append(f"{one.camera.name}: its silhouettes cannot be compared with any other's")
    reasons += [
        f"{name}: when its images were taken is known to {1e3 * one.error_s:.0f} ms, allowed: {1e3 * p.GOOD_DELAY_S:.0f}: "
        "walk longer, in curves, or give sync.toml"
        for name, one in found.delays.items()
        if not one.error_s <= p.GOOD_DELAY_S
    ]
    reasons += [
        f"{name}: its images are {one.seconds:+.1f} s late, which is as far as was searched: give sync.toml (zenocap sync)"
        for name, one in found.delays.items()
        if not abs(one.seconds) <= p.MOST_DELAY_S - p.LAG_STEP_S
    ]
    if not found.area_m[1] >= p.LEAST_WIDTH_M:
        reasons.append(
            f"the walk is {found.area_m[1]:.1f} m wide, less than {p.LEAST_WIDTH_M:g}: walk through the whole area, in "
            "curves, not along one line"
        )
    if not found.error_m <= p.GOOD_ERROR_M:
        reasons.append(
            f"the expected error is {1e3 * found.error_m:.0f} mm, more than {1e3 * p.GOOD_ERROR_M:.0f}: walk longer, half "
            "a minute or more"
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
            | _delay_data(found, one.camera.name)
            for one in found.cameras
        ],
    }


def _delay_data(found: WalkCalibration, name: str) -> dict[str, object]:
    """The delay of a camera for JSON; nothing where none was estimated."""
    if name not in found.delays:
        return {}
    one = found.delays[name]
    return {"delay_s": one.seconds, "delay_error_s": one.error_s, "delay_corrected": one.is_certain}
