"""The tracker on clips with ground truth: shared clips by views, methods, priors and settings."""

# Paper (replaced): [Hybrid VI] tests on HumanEva; here on rendered meshes moved by motion capture.

import re
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.harness.cache import content
from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from benchmarks.people.films import size_of
from benchmarks.people.mesh_joints import in_mesh_convention
from benchmarks.people.priors import KINDS, prior_named, training_frames
from benchmarks.people.shared_clips import load_clip
from benchmarks.people.simulated_clips import CYCLES, cycle_clip
from benchmarks.people.tracker import (
    PersonClip,
    TrackedPath,
    angle_errors,
    both_ways,
    centre_angles,
    errors,
    frame_errors,
    frames_until,
    of_sides,
    pose_angles,
    track_clip,
    trajectories,
)
from tests.support.stored import stored
from zenocap.common.body.anatomy import ANATOMIES
from zenocap.common.formats.angle_series import angle_series, read_source
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES, PRESETS
from zenocap.services.tracker.filter.particles import Refinement
from zenocap.services.tracker.parameters import HELD_OUT_EVERY, MIN_FRAMES_PER_REGION
from zenocap.services.tracker.states import Method, Options, TrackerSetup
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy
from zenocap.tools.teach.dataset.build_priors import PAPER as PAPER_SUFFIX

SEVEN = ("walk7", "jog7", "box7")
PAIRS = ("walk2", "bend2", "kick2", "turned2", "jump2")
RINGS: Mapping[int, tuple[int, ...]] = {
    2: (1, 3), 3: (1, 3, 5), 4: (1, 3, 5, 7), 5: (1, 2, 4, 5, 7), 6: (1, 2, 3, 4, 5, 6), 7: ()
}  # cameras of a clip with seven; all for none  # fmt: skip
POINTS = 400  # scene points of a frame set
FIRST_PERSON = 120  # of simulated clips; no shipped prior was trained with these people
REAL, REFERENCE = "real_beam4", "inverse_kinematics/angles.mot"
# No file states the man's height.  The medians of the reference's segments add up to 1.73 m: crown to neck 0.29, neck to
# hips 0.54, thigh 0.42, shank 0.41, ankle above the floor 0.07; 1.72 is the example in Pose2Sim's configuration.
HEIGHT_M = 1.72
JUMP, JUMP_FRAME = "jump2", 100  # the pose of this frame is another one than that of the frame before
AS_BEFORE, IN_ROW = 1.5, 3  # recovered: the error is below 1.5 x its median before the jump in three frames in a row
EMPTY, GAPS, RECOVERED_MM = 10, 5, 50.0  # empty frames, at so many places, and the error below which all is well again
PAPER_REGIONS = 20  # [Hybrid VI]
FEWER_REGIONS = 10  # of a take that is too short for the paper's; chosen by hand
ANGLES = {
    "knee": "knee_flexion", "hip": "hip_flexion", "ankle": "ankle_dorsiflexion", "elbow": "elbow_flexion",
    "shoulder": "shoulder_elevation",
}  # fmt: skip

ERRORS = (
    Quantity("first pose", digits=0),
    Quantity("mean", "mm", 0),
    Quantity("RMSE", "mm", 1),
    Quantity("shape", "mm", 0),
    Quantity("lost", "%", 2),
    Quantity("losses", digits=0, joined="sum"),
)
DEGREES = tuple(Quantity(f"{name}{suffix}", "°", 1) for name in ANGLES for suffix in ("", " unbiased"))
COLUMNS = (
    *ERRORS,
    Quantity("mesh", "mm", 0),
    *DEGREES,
    Quantity("recovered", "frames", 0),
    Quantity("MediaPipe", "mm", 0, ""),
    Quantity("MediaPipe shape", "mm", 0, ""),
    Quantity("MediaPipe lost", "%", 1, ""),
)


def run(one: Case) -> Figures:
    """Errors of one track.

    Options: views, size, t_pose, height, prior (a name, "shipped", "none", "same take"), preset, method, refinement,
    both_ways, gap (0 to 4: ten empty frames at that place), test (scored from the first frame that trains no prior).
    """
    clip, path = film_of(one), tracked(one)
    gap, first = gap_of(one, clip), first_frame(one, clip)
    found = errors(path, clip.truth, first)
    if "mean" in found:
        found |= _angles(one, path, clip, first)
        if one.film != REAL:
            track = in_mesh_convention(trajectories(path, clip.truth.rate, first))
            found["mesh"] = accuracy(track, clip.truth, ScoredFrames()).mpjpe_mm
    if gap or one.film == JUMP:
        found["recovered"] = _recovered(path, clip, gap)
    whole = one.option("views", 7) == 7 and not one.option("size", "")
    return found | (_mediapipe(one.film) if whole else {})


def tracked(one: Case) -> TrackedPath:
    """The track of a case, made once for all kinds that score it."""

    def made() -> TrackedPath:
        clip = film_of(one)
        setup = setup_of(one, clip)
        path = track_clip(clip, setup, gap_of(one, clip))
        return both_ways(clip, setup, path) if one.option("both_ways", False) else path

    key = one.with_options(test=False)
    return stored(made, key, [content(SHARED / name) for name in inputs(one)], sources=(__name__,))


def film_of(one: Case) -> PersonClip:
    """A shared clip, or one of CYCLES, by a person for each seed."""
    if one.film in CYCLES:
        return cycle_clip(f"{one.film}-{FIRST_PERSON + one.seed}")
    size = one.option("size", "")
    clip = load_clip(one.film, size_of(size) if size else None, t_pose=one.option("t_pose", True))
    return clip.of_views(tuple(f"cam{k:02d}" for k in RINGS[one.option("views", 7)]))


def setup_of(one: Case, clip: PersonClip) -> TrackerSetup:
    method = cast(Method, one.option("method", "hybrid"))
    preset = PRESETS[one.option("preset", "default")]
    anatomy = ANATOMIES[preset.anatomy]
    refinement = cast(Refinement, one.option("refinement", "") or preset.refinements[method])
    options = Options(
        method=method, particles=PARTICLES[method], points=POINTS, iterations=ITERATIONS[refinement],
        seed=0 if one.film in CYCLES else one.seed, refinement=refinement, filter=preset.filter,
    )  # fmt: skip
    prior = prior_named(prior_name(one, clip), anatomy) if method == "hybrid" else None
    return TrackerSetup(anatomy, clip.cameras, clip.frame_ns, prior, options, one.option("height", 0.0) or None)


def prior_name(one: Case, clip: PersonClip) -> str:
    """See `priors.prior_named`; "" for none."""
    paper = one.option("preset", "default") == "paper"
    match one.option("prior", "shipped"):
        case "none":
            return ""
        case "shipped":
            return KINDS.get(one.film, "general") + (PAPER_SUFFIX if paper else "")
        case "same take":
            name = f"{one.film}-{FIRST_PERSON + one.seed}" if one.film in CYCLES else one.film
            return take_prior(name, training(clip), paper=paper)
        case name:
            return name


def take_prior(clip: str, frames: int, *, paper: bool) -> str:
    """Prior of a clip's training frames.  paper: of 20 regions, or fewer if there are too few frames."""
    if not paper:
        return f"take:{clip}/{frames}"
    kept = 2 * frames * (HELD_OUT_EVERY - 1) // HELD_OUT_EVERY  # with the mirrored frames, without the held-out ones
    return f"take:{clip}/{frames}@{PAPER_REGIONS if kept >= PAPER_REGIONS * MIN_FRAMES_PER_REGION else FEWER_REGIONS}"


def training(clip: PersonClip) -> int:
    """Number of the first frames of a clip's motion that train a prior of the same take."""
    return training_frames(int((clip.truth.frames >= clip.motion_from).sum()))


def first_frame(one: Case, clip: PersonClip) -> int:
    """First scored frame: of the motion, or after the frames that train a prior of the same take."""
    return clip.motion_from + (training(clip) if one.option("test", False) else 0)


def gap_of(one: Case, clip: PersonClip) -> range:
    """The empty frames."""
    place = one.option("gap", -1)
    if place < 0:
        return range(0)
    start = round(np.linspace(clip.motion_from, int(clip.truth.frames[-1]), GAPS + 2)[place + 1])
    return range(start, start + EMPTY)


def _recovered(path: TrackedPath, clip: PersonClip, gap: range) -> float:
    """Frames after the empty ones, or after the jump, until the error is small again."""
    frames, distances = frame_errors(path, clip.truth)
    if gap:
        return frames_until(frames, distances, gap.stop, RECOVERED_MM)
    before = distances[(frames >= clip.motion_from) & (frames < JUMP_FRAME)]
    return frames_until(frames, distances, JUMP_FRAME, AS_BEFORE * float(np.nanmedian(before)), IN_ROW)


def _angles(one: Case, path: TrackedPath, clip: PersonClip, first: int) -> dict[str, float]:
    """RMS of ANGLES, and without the constant offset; of the real clip against OpenSim's inverse kinematics.

    Rendered clips: both from joint centres.  Their truth has no toes, hence no ankle angle.
    """
    if one.film == REAL:
        file = SHARED / "clips" / REAL / REFERENCE
        truth = angle_series(read_source(file), file, rigid_trunk=False)
        found = angle_errors(pose_angles(path, truth.rate, first), truth, first)
    else:
        estimate = centre_angles(trajectories(path, clip.truth.rate, first))
        found = angle_errors(estimate, centre_angles(clip.truth), first)
    both = {name: of_sides(found, angle) for name, angle in ANGLES.items()}
    pairs = [(name + suffix, pair[k]) for name, pair in both.items() for k, suffix in enumerate(("", " unbiased"))]
    return {name: value for name, value in pairs if np.isfinite(value)}


def _mediapipe(clip: str) -> dict[str, float]:
    """Figures of MediaPipe, all views triangulated, from the table beside the clips; none without it."""
    mean, _, shape, lost = mediapipe(SHARED / "clips" / "mediapipe.md").get(clip, (float("nan"),) * 4)
    found = {"MediaPipe": mean, "MediaPipe shape": shape, "MediaPipe lost": lost}
    return {name: value for name, value in found.items() if np.isfinite(value)}


def mediapipe(path: Path) -> dict[str, tuple[float, ...]]:
    """Mean, RMSE, shape in mm and lost % by clip, from a table in a file; empty without it."""
    if not path.is_file():
        return {}
    found = {}
    for line in path.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if len(cells) == 5 and re.fullmatch(r"[\d.]+", cells[1]):
            found[re.split("[ ,]", cells[0])[0]] = tuple(map(float, cells[1:]))
    return found


def inputs(one: Case) -> tuple[str, ...]:
    if one.film in CYCLES:
        return ()
    return (f"clips/{one.film}",)


def _clips() -> dict[str, Case]:
    found = {f"{clip}, {views} views": case(clip, views=views) for clip in SEVEN for views in (7, 4, 3)}
    found |= {f"{clip}, 2 views, 640×480": case(clip) for clip in PAIRS}
    return found | {f"{clip}, 2 views, 160×120": case(clip, size="160x120") for clip in PAIRS}


def _both(cases: Mapping[str, Case]) -> dict[str, Case]:
    """Each case live, and tracked both ways."""
    return {
        f"{name}{suffix}": one.with_options(both_ways=True) if suffix else one
        for name, one in cases.items()
        for suffix in ("", ", both ways")
    }


SMALL = case("jump2", size="160x120")
CLIPS = Kind(
    "clips",
    "The tracker on rendered people of another kind than the simulated ones, moved by motion capture. Shape is the RMSE "
    "without each joint's constant offset; mesh, the mean error in the joint convention of the truth.",
    run,
    COLUMNS,
    _both(_clips()),
    SMALL,
    seeds=5,
    rows="clip, views",
    inputs=inputs,
)
BEAM = Kind(
    "real-video",
    "A real recording, `real_beam4`, four cameras, a second person and furniture that was moved; distance to OpenPose, "
    "triangulated, and angles against OpenSim's inverse kinematics of the same key points.",
    run,
    COLUMNS,
    {
        f"{start}, prior {prior}": one.with_options(prior=prior)
        for start, one in {
            "T-pose film": case(REAL),
            f"--height {HEIGHT_M}": case(REAL, t_pose=False, height=HEIGHT_M),
            "any posture": case(REAL, t_pose=False),
        }.items()
        for prior in ("general", "walking", "none")
    },
    case(REAL, prior="none"),
    rows="start",
    inputs=inputs,
)
RECOVERY = Kind(
    "recovery",
    "Frames until the mean error is below 50 mm after ten frames in which no view shows the person.",
    run,
    COLUMNS,
    {
        f"{clip}, {views} views, place {gap + 1}": case(clip, views=views, gap=gap)
        for clip in SEVEN
        for views in (7, 4)
        for gap in range(GAPS)
    },
    SMALL,
    rows="clip, views, place",
    inputs=inputs,
)
