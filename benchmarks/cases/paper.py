"""Tables I and II of [Hybrid VI, VII] on shared clips."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cases import clips
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.tracker import TrackedPath, errors, trajectories
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.formats.angle_series import angle_series
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.takes.evaluate import ScoredFrames
from zenocap.tools.takes.evaluate_angles import AngleCurves, compared
from zenocap.tools.teach.dataset.build_priors import PAPER

MOTIONS = {"walk7": "walking", "jog7": "jogging", "box7": "boxing"}
METHODS = ("hybrid", "image-force", "particle-filter")
PRESETS = ("default", "paper")
UNFAMILIAR = {"walk7": "boxing", "jog7": "boxing", "box7": "walking"}  # shipped priors of another motion
PAPER_RMSE_MM = {
    "hybrid": (8.57, 16.77, 30.75),
    "image-force": (13.56, 666.56, 587.75),
    "particle-filter": (32.45, 48.82, 137.69),
}  # [Hybrid Table II]; walking, jogging, boxing

# Paper (open): which angles Fig. 7 averages; those of the limbs that are defined in every pose.
LIMB_ANGLES = tuple(
    f"{name}_{side}"
    for name in ("hip_flexion", "hip_adduction", "knee_flexion", "shoulder_elevation", "elbow_flexion")
    for side in "rl"
)


def run(one: Case) -> Figures:
    """Errors on the test frames, and the paper's.  Options: as `clips.run`."""
    clip, path = clips.film_of(one), clips.tracked(one)
    first = clips.first_frame(one, clip)
    found = errors(path, clip.truth, first) | {"training": clips.training(clip)}
    if "mean" in found:
        found["angles"] = angle_rmse_deg(angle_curves(trajectories(path, clip.truth.rate, first), clip.truth, first))
        found["true angles"] = errors(with_true_angles(path, clip.truth), clip.truth, first)["RMSE"]
    return found | {"paper": PAPER_RMSE_MM[one.option("method", "hybrid")][list(MOTIONS).index(one.film)]}


def with_true_angles(path: TrackedPath, truth: Trajectories) -> TrackedPath:
    """The true joint angles on the last body of a path: its error is that of the body, which no method can remove."""
    centres = {name: truth.points[:, k] for k, name in enumerate(truth.names)}
    poses = poses_from_centres(path.anatomy, centres, path.body)
    return replace(path, poses={int(k): (path.body, pose) for k, pose in zip(truth.frames, poses, strict=True)})


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


COLUMNS = (
    Quantity("RMSE", "mm", 1),
    Quantity("paper", "mm", 1, ""),
    Quantity("true angles", "mm", 1, ""),
    Quantity("shape", "mm", 1),
    Quantity("lost", "%", 1),
    Quantity("angles", "°", 1),
    Quantity("training", "frames", 0, ""),
    *(column for column in clips.ERRORS if column.name in ("first pose", "mean", "losses")),
)
SMALL = case("jog7", views=3, method="image-force", refinement="gauss-newton", test=True)

TABLE_1 = Kind(
    "table-1",
    "[Hybrid Table I]: errors on the test frames, seven views, 40 particles; the prior is of the first frames of the same "
    "take, of simulated people, or of their boxing, for boxing of walking, which is unfamiliar. True angles: their RMSE on "
    "the measured body.",
    run,
    COLUMNS,
    {
        f"{motion}, {preset}, {prior}": case(clip, preset=preset, prior=prior, test=True)
        for clip, motion in MOTIONS.items()
        for preset in PRESETS
        for prior in ("same take", "shipped")
    }
    | {
        f"{motion}, {preset}, unfamiliar": case(
            clip, preset=preset, prior=UNFAMILIAR[clip] + (PAPER if preset == "paper" else ""), test=True
        )
        for clip, motion in MOTIONS.items()
        for preset in PRESETS
    },
    SMALL,
    rows="motion, preset, prior",
    inputs=clips.inputs,
)
TABLE_2 = Kind(
    "table-2",
    "[Hybrid Table II]: methods under both presets, errors on the test frames, seven views, priors of the same take.",
    run,
    COLUMNS,
    {
        f"{preset}, {method}, {motion}": case(clip, preset=preset, method=method, prior="same take", test=True)
        for preset in PRESETS
        for method in METHODS
        for clip, motion in MOTIONS.items()
    },
    SMALL,
    rows="preset, method, motion",
    inputs=clips.inputs,
)
