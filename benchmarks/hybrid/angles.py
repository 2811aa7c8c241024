"""Joint angles of the tracker in degrees, beside a published system that tracks silhouettes.

Angles of rendered clips are computed alike from the joint centres of tracker and truth, with a trunk of one part
(`zenocap evaluate --angles` of the clip's `truth.trc`).  The truth has no toes, hence no ankle angle.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.hybrid.accuracy import cases
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import figure, with_worst
from benchmarks.hybrid.runs import ANATOMY, Run, run_trajectories
from benchmarks.sections import Cell, Row, Section, Table
from zenocap.common.body.clinical_angles import clinical_angles, joint_rotations
from zenocap.common.formats.angle_series import AngleSeries, angle_series, read_source
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.recordings.evaluate import ScoredFrames
from zenocap.tools.recordings.evaluate_angles import AngleError, compared

ANGLES = {
    "knee": "knee_flexion",
    "hip": "hip_flexion",
    "ankle": "ankle_dorsiflexion",
    "elbow": "elbow_flexion",
    "shoulder": "shoulder_elevation",
}
ANGLE_COLUMNS = tuple(ANGLES)
ANGLE_NOTE = (
    "Knee, hip and elbow: flexion; ankle: dorsiflexion; shoulder: elevation; means of both sides over the seeds, the worst "
    "seed in brackets."
)
PUBLISHED = {"knee": 11.75, "hip": 17.62, "ankle": 7.17}  # Ceseracciu et al. 2014, doi 10.1371/journal.pone.0087640

AngleErrors = Mapping[str, AngleError]


def angles(bench: Bench) -> Section:
    """Section of the clips of `accuracy`."""
    selected = cases(bench.priors_used, bench.names)
    runs = bench.runs(list(selected.values()))
    rows: list[Row] = []
    truths: dict[str, AngleSeries] = {}
    for key, case in selected.items():
        truth = truths.get(key.clip) or centre_angles(bench.clip(key.clip).truth)
        truths[key.clip] = truth
        rows.append((key.title, *angle_cells([errors_against_centres(run, truth) for run in runs[case]])))
    rows.append(("Ceseracciu 2014: gait, against markers", *(PUBLISHED.get(name, float("nan")) for name in ANGLES)))
    notes = (
        f"{bench.seeds} seeds, frames with a pose from the first frame of motion on.  {ANGLE_NOTE}  Both sides from joint "
        "centres; hip and shoulder relative to a trunk of one part.",
        "Ceseracciu, Sawacha and Cobelli (PLoS ONE 2014) compared markerless tracking to markers, with the same cameras "
        "and the same anatomical frames: mean root mean square distance in gait, flexion of knee, hip and ankle.  Other "
        "people, real images, a reference with errors of its own: a scale, not a ranking.",
    )
    title = "Angles: RMS / RMS without the constant offset, degrees"
    return Section("angles", "Joint angles", notes, (Table(title, ("clip", *ANGLE_COLUMNS), tuple(rows)),))


def centre_angles(centres: Trajectories) -> AngleSeries:
    """Joint angles of joint centres, with a trunk of one part."""
    return angle_series(centres, Path("centres"), rigid_trunk=True)


def file_angles(path: Path) -> AngleSeries:
    """Joint angles of a file, such as a .mot.  Raises UserError."""
    return angle_series(read_source(path), path, rigid_trunk=False)


def errors_against_centres(run: Run, truth: AngleSeries) -> AngleErrors:
    """Errors of the scored frames, both sides from joint centres; empty without a pose."""
    if not any(run.centres_mm):
        return {}
    return _errors(centre_angles(run_trajectories(run, truth.rate)), truth, run.first)


def errors_against_angles(run: Run, truth: AngleSeries) -> AngleErrors:
    """Errors of the angles of the scored frames' poses; empty without a pose."""
    if not any(run.angles):
        return {}
    return _errors(run_angles(run, truth.rate), truth, run.first)


def run_angles(run: Run, rate: float) -> AngleSeries:
    """Joint angles of the scored frames.  rate: frames per second."""
    frames = run.first + np.arange(len(run.angles), dtype=np.int64)
    known = np.array([bool(row) for row in run.angles])
    unknown = (float("nan"),) * len(ANATOMY.angles)
    values = np.array([row or unknown for row in run.angles])
    return AngleSeries(frames, frames / rate, known, clinical_angles(joint_rotations(ANATOMY, values)), rate)


def angle_cells(errors: Sequence[AngleErrors]) -> tuple[Cell, ...]:
    """RMS / RMS without the constant offset by ANGLES, mean and worst over the seeds."""
    cells = []
    for name in ANGLES.values():
        both = [_of_sides(one, name) for one in errors]
        rms, unbiased = (figure([pair[k] for pair in both]) for k in (0, 1))
        cells.append(f"{with_worst(rms)} / {with_worst(unbiased)}" if np.isfinite(rms.mean) else "–")
    return tuple(cells)


def _of_sides(errors: AngleErrors, name: str) -> tuple[float, float]:
    """RMS, and RMS without each side's constant offset, over both sides; NaN where neither is compared."""
    sides = [errors[f"{name}_{letter}"] for letter in "rl" if f"{name}_{letter}" in errors]
    if not sides:
        return float("nan"), float("nan")
    squares = np.array([(one.rms_deg**2, one.rms_unbiased_deg**2) for one in sides])
    rms, unbiased = np.sqrt(np.average(squares, axis=0, weights=[one.frames for one in sides]))
    return float(rms), float(unbiased)


def _errors(estimate: AngleSeries, truth: AngleSeries, first: int) -> AngleErrors:
    names = Path("estimate"), Path("truth")  # for errors
    return compared(estimate, truth, ScoredFrames(first=Bound(first)), *names)[0].angles
