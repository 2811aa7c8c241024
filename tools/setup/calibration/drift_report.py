"""Report on moved cameras, and the corrected calibration."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from zenocap.common import messages as m
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import camera_of
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import Outline
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.folder import plain_name
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.parameters import MIN_AREA
from zenocap.tools.judge.verdict import USED
from zenocap.tools.judge.view_lag import seen_outline
from zenocap.tools.setup.calibration.drift import Drift, drift_of, turn_deg
from zenocap.tools.setup.calibration.parameters import LEAST_INSTANTS, MUCH_PX, SAME_DEG, SAME_M


def messages_of(path: Path) -> Iterator[m.Message]:
    """The messages of a take that the check needs.  Raises UserError for a file that is no take."""
    return (received.message for received in TakeReader(path).envelopes(USED))


def take_drift(path: Path, messages: Iterable[m.Message]) -> tuple[Drift, dict[str, Camera]]:
    """Drift in a take and its cameras by their names, at the working size.  Raises UserError."""
    evidence = evidence_of(messages)
    cameras = {viewer: camera_of(one) for viewer, one in evidence.cameras.items()}
    if len(cameras) < 2:
        raise UserError(
            f"{path}: {len(cameras)} camera(s): allowed: a take of two or more cameras, tracked with silhouettes"
        )
    instants: list[dict[str, Outline]] = []
    samples = [sample for _, sample in sorted(evidence.samples.items())]
    posed = [sample for sample in samples if sample.pose_ns is not None]
    # Silhouettes without a tracked person may be noise; a camera that was moved far may be why none is tracked.
    for sample in posed if len(posed) >= LEAST_INSTANTS else samples:
        seen: dict[str, Outline] = {}
        for viewer, silhouette in sample.silhouettes.items():
            outline = seen_outline(cameras[viewer], silhouette, least=MIN_AREA) if viewer in cameras else None
            if outline is not None:
                seen[cameras[viewer].name] = outline
        instants.append(seen)
    named = {camera.name: camera for camera in cameras.values()}
    try:
        return drift_of(named, instants), named
    except ValueError as error:
        raise UserError(f"{path}: {error}; film a person who walks through the whole area for half a minute") from error


def drift_lines(found: Drift) -> list[str]:
    pairs = ", ".join(f"{one} and {other} {px:.1f}" for (one, other), px in found.pairs_px.items())
    lines = [f"{found.instants} frame sets compared; silhouettes of pairs of cameras disagree, px: {pairs}"]
    for one in found.moved:
        lines.append(
            f"{one.name} was moved: turned by {one.turn_deg:.2f} ± {one.turn_error_deg:.2f} degrees, shifted by "
            f"{1000 * one.shift_m:.0f} ± {1000 * one.shift_error_m:.0f} mm; a person appears {one.apart_px:.1f} ± "
            f"{one.error_px:.1f} px beside the old place"
        )
        lines.append(f"  its silhouettes disagree with the others by {one.before_px:.1f} px, now by {one.after_px:.1f} px")
    if found.unchecked:
        lines.append(
            f"not checked: {', '.join(found.unchecked)}: the person is seldom seen whole there and in another view"
        )
    if found.moved:
        return lines
    agreed = "no camera was moved" if len(found.pairs_px) > 1 else "no contradiction; two cameras show only some motions"
    return [*lines, *(_unexplained(found) or [agreed])]


def _unexplained(found: Drift) -> list[str]:
    """A disagreement that no single camera explains."""
    much = [pair for pair, px in found.pairs_px.items() if px > MUCH_PX]
    if not much:
        return []
    pairs = ", ".join(f"{one} and {other}" for one, other in much)
    if len(found.pairs_px) == 1:
        return [f"{pairs} disagree; two cameras do not show which one was moved: calibrate again, or check both"]
    return [
        f"{pairs} disagree, and no single camera explains it: shadows, another person, videos out of step (zenocap sync)"
    ]


def contradicts(found: Drift) -> bool:
    """Whether a camera was moved or could not be checked, or a disagreement is left unexplained."""
    return bool(found.moved or found.unchecked or _unexplained(found))


def calibrated_cameras(path: Path, up_axis: str) -> dict[str, Camera]:
    """Cameras of a calibration file by their names in takes, which keep the characters of keys.  Raises UserError."""
    return {plain_name(name): camera for name, camera in read_calibration(path, up_axis).items()}


def corrected(found: Drift, cameras: Mapping[str, Camera], calibrated: Mapping[str, Camera] | None) -> dict[str, Camera]:
    """Calibration with the new poses of the moved cameras.

    cameras: of the take.  calibrated: of the calibration file that was used, by the same names; None: those of the take.
    Raises UserError for another calibration.
    """
    if calibrated is not None:
        _check_same(cameras, calibrated)
    whole = dict(calibrated or cameras)
    for one in found.moved:
        # The motion in the camera's frame is the same at every size of its images.
        old = cameras[one.name]
        turn = one.camera.rotation @ old.rotation.T
        shift = one.camera.translation - turn @ old.translation
        base = whole[one.name]
        whole[one.name] = replace(base, rotation=turn @ base.rotation, translation=turn @ base.translation + shift)
    return whole


def _check_same(cameras: Mapping[str, Camera], calibrated: Mapping[str, Camera]) -> None:
    """Refuse a calibration that is not that of the take: a motion on top of another pose would look right and be wrong."""
    for name, camera in cameras.items():
        if name not in calibrated:
            raise UserError(
                f"the calibration has no camera {name!r}, which is in the take; there are: {', '.join(calibrated)}"
            )
        other = calibrated[name]
        turned_deg, apart_m = turn_deg(other, camera), float(np.linalg.norm(other.centre - camera.centre))
        if turned_deg > SAME_DEG or apart_m > SAME_M:
            raise UserError(
                f"{name}: the calibration has it turned by {turned_deg:.2f} degrees and {1000 * apart_m:.0f} mm away from "
                "the take's: allowed: the calibration that the take was recorded or tracked with"
            )


def drift_data(found: Drift) -> dict[str, object]:
    """The content of the report for JSON."""
    moved = [{key: value for key, value in vars(one).items() if key != "camera"} for one in found.moved]
    pairs = [{"cameras": list(pair), "px": px} for pair, px in found.pairs_px.items()]
    return {"moved": moved, "unchecked": list(found.unchecked), "pairs": pairs, "instants": found.instants}
