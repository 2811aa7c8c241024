"""The paper's experiments: three motions, trained on the first frames of a take, tested on the others.  [Hybrid VI, VII]"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import Figure, figure
from benchmarks.hybrid.priors import KINDS, training_frames
from benchmarks.hybrid.runs import Case, Film, Run, run_trajectories
from zenocap.common.arrays import Floats, Ints
from zenocap.common.formats.angle_series import angle_series
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES, PRESETS
from zenocap.services.tracker.filter.particles import Refinement
from zenocap.services.tracker.parameters import HELD_OUT_EVERY, MIN_FRAMES_PER_REGION
from zenocap.services.tracker.states import Method
from zenocap.tools.dataset.build_priors import PAPER as PAPER_SUFFIX
from zenocap.tools.recordings.evaluate import ScoredFrames, accuracy
from zenocap.tools.recordings.evaluate_angles import AngleCurves, compared

MOTIONS = {"walk7": "walking", "jog7": "jogging", "box7": "boxing"}
METHODS: tuple[Method, ...] = ("hybrid", "image-force", "particle-filter")
PRESET_NAMES = ("default", "paper")
PAPER_TRAINING_FRAMES = 100  # [Hybrid Table I]
PAPER_TEST_FRAMES = {"walk7": 433, "jog7": 393, "box7": 377}  # [Hybrid Table I]
PAPER_RMSE_MM: dict[Method, tuple[float, float, float]] = {
    "hybrid": (8.57, 16.77, 30.75),
    "image-force": (13.56, 666.56, 587.75),
    "particle-filter": (32.45, 48.82, 137.69),
}  # [Hybrid Table II]; walking, jogging, boxing
PAPER_S: dict[Method, tuple[int, int, int]] = {
    "hybrid": (15, 14, 17), "image-force": (3, 2, 2), "particle-filter": (250, 256, 271)
}  # fmt: skip
PAPER_REGIONS = 20  # [Hybrid VI]
FEWER_REGIONS = 10  # of a take that is too short for the paper's; chosen by hand

# Paper (open): which angles Fig. 7 averages; those of the limbs that are defined in every pose.
LIMB_ANGLES = tuple(
    f"{name}_{side}"
    for name in ("hip_flexion", "hip_adduction", "knee_flexion", "shoulder_elevation", "elbow_flexion")
    for side in "rl"
)


@dataclass(frozen=True)
class ProtocolErrors:
    """Errors of a case on the test frames, over its seeds.  rmse, shape: millimetres.  lost: % of the joints.

    angles: RMSE of LIMB_ANGLES, degrees.
    """

    rmse: Figure
    shape: Figure
    lost: Figure
    angles: Figure


def frames_of(clip: Film) -> tuple[int, int]:
    """Number of training and of test frames of a clip; the training frames are the first of the motion."""
    motion = int((clip.truth.frames >= clip.motion_from).sum())
    training = training_frames(motion)
    return training, motion - training


def first_test_frame(clip: Film) -> int:
    return clip.motion_from + frames_of(clip)[0]


def take_prior(clip: str, training: int, preset: str) -> str:
    """Prior of a clip's training frames.  Preset `paper`: of 20 regions, or fewer if there are too few frames."""
    name = f"take:{clip}/{training}"
    if preset != "paper":
        return name
    kept = 2 * training * (HELD_OUT_EVERY - 1) // HELD_OUT_EVERY  # with the mirrored frames, without the held-out ones
    return f"{name}@{PAPER_REGIONS if kept >= PAPER_REGIONS * MIN_FRAMES_PER_REGION else FEWER_REGIONS}"


def shipped_prior(clip: str, preset: str) -> str:
    return KINDS[clip] + (PAPER_SUFFIX if preset == "paper" else "")


def case_of(clip: str, preset: str, method: Method, prior: str = "", refinement: Refinement | None = None) -> Case:
    """Case with the defaults of a preset, seven views.  prior: of method hybrid, else ignored."""
    used = refinement or cast(Refinement, PRESETS[preset].refinements[method])
    return Case(
        clip, prior=prior if method == "hybrid" else "", method=method, particles=PARTICLES[method],
        refinement=used, iterations=ITERATIONS[used], preset=preset,
    )  # fmt: skip


def method_cases(bench: Bench) -> dict[tuple[str, Method, str], Case]:
    """Cases of Table II by preset, method and clip; the hybrid method has the prior of the training frames."""
    return {
        (preset, method, clip): case_of(clip, preset, method, take_prior(clip, frames_of(bench.clip(clip))[0], preset))
        for preset in PRESET_NAMES for method in METHODS for clip in MOTIONS
    }  # fmt: skip


def runs_of(bench: Bench, cases: Sequence[Case]) -> dict[Case, list[Run]]:
    """Runs of every case; one seed with one particle, where nothing is random."""
    many = bench.runs([case for case in cases if case.particles > 1])
    return many | bench.runs([case for case in cases if case.particles == 1], seeds=1)


def errors_of(truth: Trajectories, first: int, runs: Sequence[Run]) -> ProtocolErrors:
    """Errors from frame `first` on; seeds without a pose there count as lost only."""
    each = [_errors(truth, first, run) for run in runs]
    return ProtocolErrors(*(figure(values) for values in zip(*each, strict=True)))


def _errors(truth: Trajectories, first: int, run: Run) -> tuple[float, float, float, float]:
    """RMSE and shape in mm, lost in %, RMSE of the angles in degrees."""
    nan = float("nan")
    if not has_pose(run, first):
        return nan, nan, 100.0, nan
    track = run_trajectories(run, truth.rate)
    found = accuracy(track, truth, ScoredFrames(first=Bound(first)))
    return found.rmse_mm, found.shape_mm, found.lost_pct, angle_rmse_deg(angle_curves(track, truth, first))


def has_pose(run: Run, first: int) -> bool:
    """Whether there is a pose from frame `first` on."""
    return any(run.centres_mm[max(0, first - run.first) :])


def angle_curves(track: Trajectories, truth: Trajectories, first: int) -> AngleCurves:
    """Joint angles of both from frame `first` on, both from joint centres and with a trunk of one part, as in the paper."""
    names = Path("estimate"), Path("truth")  # for errors
    series = [angle_series(one, name, rigid_trunk=True) for one, name in zip((track, truth), names, strict=True)]
    _, curves = compared(series[0], series[1], ScoredFrames(first=Bound(first)), *names)
    return curves


def angle_rmse_deg(curves: AngleCurves) -> float:
    """RMSE over LIMB_ANGLES and frames."""
    squares = np.concatenate([(curves.take[name] - curves.truth[name]) ** 2 for name in LIMB_ANGLES])
    return float(np.sqrt(np.nanmean(squares)))


def frame_rmse_mm(truth: Trajectories, first: int, run: Run) -> tuple[Ints, Floats]:
    """Frames from `first` on, and the RMSE over the joints in each; NaN without a pose."""
    kept = truth.frames >= first
    frames, expected = truth.frames[kept], truth.points[kept]
    result = np.full(len(frames), np.nan)
    if not has_pose(run, first):
        return frames, result
    track = run_trajectories(run, truth.rate)
    rows = {int(frame): k for k, frame in enumerate(track.frames)}
    columns = [track.names.index(name) for name in truth.names]
    for k, frame in enumerate(frames):
        if int(frame) in rows:
            squares = np.sum((track.points[rows[int(frame)], columns] - expected[k]) ** 2, axis=1)
            result[k] = 1e3 * float(np.sqrt(squares.mean()))
    return frames, result


def of_regions(case: Case, clip: str, regions: int) -> Case:
    """The case with a prior of exactly that number of regions, trained on the simulated person."""
    return replace(case, prior=f"actor:{KINDS[clip]}@{regions}")
