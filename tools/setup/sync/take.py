"""Camera delays of a take, from the silhouettes of its first 20 s with a person."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import camera_of
from zenocap.common.errors import UserError
from zenocap.common.lags.delays import CameraLags, limits_of, silhouette_lags
from zenocap.common.lags.tangents import Outline
from zenocap.common.rig.file import MAX_DELAY_MS
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.verdict import evidence_in
from zenocap.tools.judge.view_lag import outlines_of


@dataclass(frozen=True)
class TakeDelays(CameraLags):
    """period_s: of the silhouettes, by viewer."""

    period_s: Mapping[str, float]


def take_delays(path: Path) -> TakeDelays:
    """Delays of the cameras of a take.  Raises UserError for a file that is no take, or without silhouettes."""
    return delays_of(evidence_in(path), path)


def delays_of(evidence: TakeEvidence, path: Path) -> TakeDelays:
    """Delays from the evidence of a take.  path: of the take, for errors.  Raises UserError."""
    outlines = {viewer: one for viewer, one in outlines_of(evidence).items() if len(one) > 2}
    if len(outlines) < 2:
        raise UserError(f"{path}: silhouettes of a person in {len(outlines)} view(s): allowed: two or more views")
    return delays_between({viewer: camera_of(evidence.cameras[viewer]) for viewer in outlines}, outlines)


def delays_between(cameras: Mapping[str, Camera], outlines: Mapping[str, list[Outline]]) -> TakeDelays:
    """Delays of calibrated cameras from the outlines of a person, with their capture times."""
    lags = silhouette_lags(cameras, outlines, limits_of(MAX_DELAY_MS / 1e3))
    periods = {viewer: (one[-1].time_s - one[0].time_s) / (len(one) - 1) for viewer, one in outlines.items()}
    return TakeDelays(lags.offsets, periods)


def lines_of(found: TakeDelays) -> list[str]:
    """For each viewer its delay, ms and frames, with its error; or why it is not certain."""
    lines = []
    delays = found.delays_ms if not found.uncertain else {}
    for viewer, one in found.offsets.items():
        if one.reason:
            lines.append(f"{viewer}: not certain: {one.reason}")
        elif viewer in delays:
            frames = delays[viewer] / 1e3 / found.period_s[viewer]
            error_ms = 1e3 * one.error_s
            lines.append(f"{viewer}: {delays[viewer]:.0f} ms late, {frames:.2f} frames (± {error_ms:.0f} ms)")
    return lines


def rig_lines(found: TakeDelays) -> list[str]:
    """Lines for the `[[viewer]]` tables of the rig file."""
    return [f"delay_ms = {value:.1f}  # viewer {viewer}" for viewer, value in found.delays_ms.items()]
