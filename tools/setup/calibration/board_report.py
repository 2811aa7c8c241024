"""Report of a calibration with a board: what each camera saw, what fits, what to film next."""

from collections.abc import Iterable

import numpy as np

from zenocap.tools.setup.calibration.board_calibration import BoardCalibration, CalibratedCamera
from zenocap.tools.setup.calibration.parameters import GOOD_COVERAGE, GOOD_ERROR_M, GOOD_FOCAL, GOOD_PX, GOOD_SHARED

GOOD_WIDTH_PX = 1280  # width of the images for which GOOD_PX is stated


def report(found: BoardCalibration) -> list[str]:
    """Lines of text: cameras, pairs, and the error to expect."""
    lines = [f"board: {found.board}{_variant(found)}"]
    for one in found.cameras:
        x, y, z = one.camera.centre
        precision = "" if one.given_lens else f" ± {one.focal_error:.1%}"
        lens = "given lens" if one.given_lens else f"lens with {one.lens}"
        delay = "" if found.still or one is found.cameras[0] else f", images {1000 * one.delay_s:+.0f} ms from their times"
        lines += [
            f"{one.camera.name}: {one.views} of {one.looks} images show the board, in {one.coverage:.0%} of the image",
            f"  corners {one.residual_px:.2f} px off{delay}",
            f"  {lens}, focal length {_focal(one):.1f} px{precision}",
            f"  at ({x:.3f}, {y:.3f}, {z:.3f}) m",
        ]
        if one.rolling_shutter:
            lines.append(_rolling_shutter(one))
    pairs = ", ".join(f"{one} and {other} {count}" for (one, other), count in found.shared.items())
    lines += [f"seen together: {pairs}"] if pairs else []
    if found.left_out:
        lines.append(f"{found.left_out} images contradicted all others and were left out")
    if found.error_m == found.error_m:  # a single camera has none
        lines.append(
            f"expected error where the board was: {1000 * found.error_m:.1f} mm, and 1 % by each 1 % of the square"
        )
    return lines


def verdict(found: BoardCalibration) -> tuple[str, list[str]]:
    """Verdict, good or poor, and what to do better, for people."""
    reasons: list[str] = []
    for one in found.cameras:
        reasons += _camera_reasons(one, found)
    if len(found.cameras) > 1 and np.isnan(found.error_m):
        reasons.append("the expected error is unknown: no two cameras see the board at enough places")
    elif found.error_m > GOOD_ERROR_M:
        reasons.append(
            f"the expected error is {1000 * found.error_m:.0f} mm, more than {1000 * GOOD_ERROR_M:g}: show the board "
            "longer, nearer, tilted, and to several cameras at once"
        )
    return ("poor" if reasons or found.world.remarks else "good"), [*reasons, *found.world.remarks]


def _camera_reasons(one: CalibratedCamera, found: BoardCalibration) -> Iterable[str]:
    name = one.camera.name
    limit = GOOD_PX * max(0.5, one.camera.size[0] / GOOD_WIDTH_PX)
    if not one.residual_px <= limit:  # also where it is unknown
        yield (
            f"{name}: corners are {one.residual_px:.1f} px off, more than {limit:.1f}: did the videos begin at different "
            "times (zenocap sync), is the board flat, the shutter short, are --columns and --rows as printed? Move slowly"
        )
    if not one.given_lens and one.focal_error > GOOD_FOCAL:
        known = f"{name}: the focal length is known to {one.focal_error:.1%}"
        yield f"{known}: show the board nearer and tilted by 30 to 50 degrees"
    if not one.given_lens and one.coverage < GOOD_COVERAGE:
        yield f"{name}: the board was in {one.coverage:.0%} of the image: show it near the borders and corners too"
    together = sum(count for pair, count in found.shared.items() if name in pair)
    if len(found.cameras) > 1 and together < GOOD_SHARED:
        yield f"{name}: only {together} moments with another camera: show the board to both at once"


def report_data(found: BoardCalibration) -> dict[str, object]:
    """The content of report and verdict for JSON."""
    word, reasons = verdict(found)
    cameras = [
        {
            "name": one.camera.name,
            "size_px": list(one.camera.size),
            "position_m": one.camera.centre.tolist(),
            "focal_px": _focal(one),
            "focal_error": one.focal_error,
            "lens": one.lens,
            "images": one.looks,
            "views": one.views,
            "coverage": one.coverage,
            "residual_px": one.residual_px,
            "held_out_px": one.held_out_px if one.held_out_px < float("inf") else None,
            "delay_s": one.delay_s,
            "readout_s": one.readout_s,
            "readout_error_s": one.readout_error_s,
            "rolling_shutter": one.rolling_shutter,
        }
        for one in found.cameras
    ]
    return {
        "verdict": word,
        "reasons": reasons,
        "board": str(found.board),
        "cameras": cameras,
        "seen_together": [{"cameras": list(pair), "moments": count} for pair, count in found.shared.items()],
        "expected_error_m": found.error_m if found.error_m == found.error_m else None,
        "floor": found.world.known,
        "left_out": found.left_out,
    }


def _rolling_shutter(one: CalibratedCamera) -> str:
    """The line that names it."""
    way = "" if one.readout_s > 0 else ", from the bottom up: is the image turned by 180 degrees?"
    found = f"{1000 * abs(one.readout_s):.0f} ms ± {1000 * one.readout_error_s:.0f} in {one.camera.name}"
    return f"  rolling shutter of about {found}, from the first to the last row{way}"


def _focal(one: CalibratedCamera) -> float:
    lens = one.camera.fisheye
    return float((one.camera.matrix if lens is None else lens.matrix)[0, 0])


def _variant(found: BoardCalibration) -> str:
    words = ["layout of OpenCV before 4.6"] * found.board.legacy + ["inverted"] * found.board.inverted
    return f" ({', '.join(words)})" if words else ""
