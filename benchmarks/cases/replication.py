"""Replication of Table II and figures of [Hybrid]: people who are the model, frames as in the paper."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from typing import cast

import msgspec
import numpy as np

from benchmarks.cases.clips import POINTS
from benchmarks.cases.paper import COLUMNS, METHODS, PAPER_RMSE_MM, angle_curves, angle_rmse_deg, with_true_angles
from benchmarks.harness.cache import content
from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, Value, case
from benchmarks.people.cylinders import COUNTS, MOTIONS, REGIONS, CylinderClip, cylinder_clip, prior_of, training_poses
from benchmarks.people.films import motion_file
from benchmarks.people.tracker import NAMES, TrackedPath, errors, offsets, track_clip, trajectories
from tests.support.stored import stored
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES, PRESETS, ForceLaw
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.filter.filter_step import start_tracking
from zenocap.services.tracker.filter.particles import Refinement
from zenocap.services.tracker.states import Method, Options, TrackerSetup
from zenocap.services.tracker.tracking import initial_state, known_person

LAWS: tuple[ForceLaw, ...] = ("quadratic", "linear")
PEOPLE = (122, 123, 125)  # adults, 1.60 to 1.73 m; of a seed each
T_POSE, TRUE_POSE = "T-pose", "true pose"
HEADING = 0.0  # of the T-pose: ten parts have no feet, which would show where the front is
FEWER = 100  # test frames of what the paper does not have; a third of the time
MAIN = ((T_POSE, 0), (TRUE_POSE, 0), (TRUE_POSE, FEWER))  # starts and numbers of test frames, 0 for the paper's
OTHER = ((T_POSE, FEWER), (TRUE_POSE, 0), (TRUE_POSE, FEWER))  # of the other force law
UNFAMILIAR = {"walking": "boxing", "jogging": "boxing", "boxing": "walking"}  # motion of the prior's training frames
CAUSES: Mapping[str, Mapping[str, Value]] = {  # what may cause the error of the hybrid method
    "4 × points": {"points": 4 * POINTS},
    "4 × steps": {"iterations": 4 * ITERATIONS["force-printed"]},
    "4 × particles": {"particles": 4 * PARTICLES["hybrid"]},
    "prior of the test frames": {"same": True},
    "round ends": {"ends": "round"},
}
OF_FORCE = {name: CAUSES[name] for name in ("4 × points", "4 × steps", "round ends")}  # of one particle without a prior
WRISTS = [NAMES.index(name) for name in ("RWrist", "LWrist")]


def run(one: Case) -> Figures:
    """Errors on the test frames, and the paper's.

    Options: method, law, start (T-pose, then all frames; or true body and pose before the first test frame), tested
    (number of test frames, 0 for the paper's), trained (motion that trains the prior, "" for the tested one), same (whether
    the test frames train it), ends, regions, points, iterations, particles.
    """
    motion, method = one.film, one.option("method", "hybrid")
    film, path = clip_of(one).film, tracked(one)
    first, truth = film.motion_from, film.truth
    found = errors(path, truth, first) | {"paper": PAPER_RMSE_MM[method][list(MOTIONS).index(motion)]}
    if "mean" in found:
        found["angles"] = angle_rmse_deg(angle_curves(trajectories(path, truth.rate, first), truth, first))
        found["true angles"] = errors(with_true_angles(path, truth), truth, first)["RMSE"]
        found["of the paper's"] = found["RMSE"] / found["paper"]
        wrists = offsets(path, truth)[first:, WRISTS]
        found["wrists"] = 1e3 * float(np.sqrt(np.nanmean((wrists**2).sum(axis=2))))
    if method == "hybrid":  # frames that differ in joint angles, which follow those of the root
        found["training"] = len({pose.angles[3:].tobytes() for pose in training_poses(*_training(one))})
    return found


def clip_of(one: Case) -> CylinderClip:
    return cylinder_clip(one.film, _person(one), one.option("tested", 0) or None)


def tracked(one: Case) -> TrackedPath:
    """The track of a case, made once for the table and the figures."""
    return stored(partial(_tracked, one), one, [content(SHARED / name) for name in inputs(one)], sources=(__name__,))


def _tracked(one: Case) -> TrackedPath:
    clip = clip_of(one)
    setup, first = setup_of(one, clip), clip.film.motion_from
    if one.option("start", T_POSE) == T_POSE:
        return track_clip(clip.film, setup)
    pose, before = RootedPose.of(TEN_PARTS, clip.body, clip.poses[first - 1]), clip.film.instants[first - 1]
    phase, _ = start_tracking(setup, known_person(setup, clip.body), pose, before.captured_ns, 0.0)
    film = replace(clip.film, instants=clip.film.instants[first:])
    return track_clip(film, setup, state=replace(initial_state(setup), phase=phase))


def setup_of(one: Case, clip: CylinderClip) -> TrackerSetup:
    method, preset = cast(Method, one.option("method", "hybrid")), PRESETS["paper"]
    refinement = cast(Refinement, preset.refinements[method])
    law, ends = one.option("law", LAWS[0]), one.option("ends", preset.filter.ends)
    options = Options(
        method=method, seed=one.seed, refinement=refinement, points=one.option("points", POINTS),
        particles=one.option("particles", PARTICLES[method]), iterations=one.option("iterations", ITERATIONS[refinement]),
        filter=msgspec.structs.replace(preset.filter, force_law=law, ends=ends),
        heading=HEADING if one.option("start", T_POSE) == T_POSE else None,
    )  # fmt: skip
    prior = prior_of(*_training(one), one.option("regions", REGIONS)) if method == "hybrid" else None
    return TrackerSetup(TEN_PARTS, clip.film.cameras, clip.film.frame_ns, prior, options)


def _training(one: Case) -> tuple[str, int, bool]:
    """Motion and person of the frames that train the prior, and whether they are the test frames."""
    return one.option("trained", "") or one.film, _person(one), one.option("same", False)


def _person(one: Case) -> int:
    return PEOPLE[one.seed % len(PEOPLE)]


def inputs(one: Case) -> tuple[str, ...]:
    return tuple(motion_file(MOTIONS[name]) for name in (one.film, one.option("trained", "")) if name)


def _cases() -> dict[str, Case]:
    """The paper's table, from both starts, and with the other force law from the true pose; then 100 test frames of other
    numbers of regions, causes of the error, among them the other ends, and a prior of another motion."""
    found: dict[str, Case] = {}
    for method in METHODS:
        laws: tuple[ForceLaw | None, ...] = LAWS if method != "particle-filter" else (None,)
        for law, motion in product(laws, MOTIONS):
            for start, tested in OTHER if law == LAWS[1] else MAIN:
                options: dict[str, Value] = {"method": method, "start": start, "tested": tested}
                if law is not None:
                    options["law"] = law
                name = f"{method}{'' if law is None else f', {law}'}, {start}, {tested or 'all'} frames, {motion}"
                found[name] = case(motion, **options)
    regions: dict[str, Mapping[str, Value]] = {f"M = {count}": {"regions": count} for count in COUNTS if count != REGIONS}
    causes = [("hybrid", *row) for row in (regions | dict(CAUSES)).items()] + [
        ("image-force", *row) for row in OF_FORCE.items()
    ]
    for (method, changed, values), motion in product(causes, MOTIONS):
        name = f"{method}, {changed}, {TRUE_POSE}, {FEWER} frames, {motion}"
        found[name] = case(motion, method=method, start=TRUE_POSE, tested=FEWER, **values)
    for motion, other in UNFAMILIAR.items():
        name = f"hybrid, unfamiliar motion, {TRUE_POSE}, {FEWER} frames, {motion}"
        found[name] = case(motion, start=TRUE_POSE, tested=FEWER, trained=other)
    return found


REPLICATION = Kind(
    "replication",
    "[Hybrid Table II] where it can be fair: three adults who are the ten-part model, flat-ended cylinders in seven "
    "views of 640×480 and moved by motion capture on a circle of 2 m; preset `paper`. The prior is of the first 100 frames "
    "of a file, or of half of a shorter one, the test frames are of the rest; too few are repeated. Training: frames that "
    "differ. All frames: the paper's number. Unfamiliar: a prior of boxing, for boxing of walking. M: regions, else 20.",
    run,
    (*COLUMNS, Quantity("of the paper's", digits=1), Quantity("wrists", "mm", 1)),
    _cases(),
    case("walking", method="image-force", start=TRUE_POSE, tested=20),
    rows="method, force, start, motion",
    inputs=inputs,
)
