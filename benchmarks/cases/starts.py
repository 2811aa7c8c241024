"""Starts of the tracker, confidence of its poses, limits of [Two-view]: people before two cameras."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from sklearn.metrics import roc_auc_score

from benchmarks.cases.two_cameras import tracked_by
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.errors import REVERSED_DEG, film_errors, frame_error, limbs_right
from benchmarks.people.films import (
    MOTIONS,
    VIEWERS,
    Film,
    captured_film,
    filmed,
    heading_film,
    motion_file,
    posture_film,
    size_of,
)  # fmt: skip
from benchmarks.people.session import Track, tracked, tracker_of
from tests.support.stored import stored
from zenocap.common.arrays import Bools, Floats, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.conversion import bdp_of, pose_of
from zenocap.common.messages import Silhouette, TrackerBdp, TrackerPose
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.evidence.evidence import evidence_of, misfit
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.hull.contour_rays import extract_outlines
from zenocap.services.tracker.parameters import ESTIMATE_HOLD, ESTIMATE_ITERATIONS
from zenocap.services.tracker.states import Options, TrackerSetup
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement, interpolate, minimum_jerk, neutral, place
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import t_pose

SETTLED_S = 2.0  # from the first frame of the motion on: errors are compared after it
HEADINGS = range(0, 360, 15)  # degrees
CAMERA_HEADINGS = dict(zip(VIEWERS, (0, 270), strict=True))  # degrees, towards the paper's cameras
FACING_DEG = 80
FIRST_PERSON = {"motions": 12, "postures": 12, "T-poses": 48}
BINS = (0.0, 0.25, 0.5, 0.75, 0.9, 1.0)
CHECKED = 24  # first person of the check of the confidence
EMPTY, STRETCHED, LOWERING, HELD, MOVING = 15, 20, 10, 30, 9  # frames of a scenario
LIMITED = 60  # first person of the scenarios


def without_t_pose(whole: Film) -> Film:
    """The film without the frames between the empty scene and the motion."""
    kept = [*range(whole.empty), *range(whole.motion_from, len(whole.truths))]
    return replace(
        whole,
        images={viewer: images[kept] for viewer, images in whole.images.items()},
        truths=tuple(whole.truths[k] for k in kept),
        motion_from=whole.empty,
    )


def films_of(one: Case) -> list[Film]:
    """Films of one person: each posture, or each motion.  Options: only, one of them."""
    who = FIRST_PERSON[one.film] + one.seed
    names = MOTIONS if one.film == "motions" else POSTURES
    chosen = [name for name in names if one.option("only", name) == name]
    return [captured_film(who, name) if one.film == "motions" else posture_film(who, name) for name in chosen]


def run(one: Case) -> Figures:
    """Starts of one person, and errors once settled.  Options: t_pose, whether the person shows the T-pose first."""
    after, yaws, joints = [], [], []
    every = films_of(one)
    for film in every:
        shown = film if one.option("t_pose", False) else without_t_pose(film)
        found = tracked(shown).estimates
        if not found:
            continue
        after.append((min(found) - shown.motion_from) / shown.fps)
        errors = film_errors(shown, found, shown.motion_from + round(SETTLED_S * shown.fps))
        known = [error for error in errors if np.isfinite(error.yaw)]
        yaws.append(float(np.median([error.yaw for error in known])))
        joints.append(float(np.mean([error.joints.mean() for error in known])))
    started = (
        {"after": float(np.median(after)), "last": max(after), "joints": float(np.mean(joints)), "worst take": max(joints)}
        if after
        else {}
    )
    turned = sum(yaw > REVERSED_DEG for yaw in yaws)
    return {"takes": len(every), "started": len(after), "turned round": turned, **started}


def run_headings(one: Case) -> Figures:
    """Starts of one person in the T-pose at every heading.

    Options: decided, with the user's decision: the nearer camera where it is less than 80 degrees from the heading, else
    the
    heading to the nearest 45 degrees.  every: degrees between two headings.
    """
    headings, errors = range(0, 360, one.option("every", HEADINGS.step)), []
    for heading in headings:
        film = heading_film(FIRST_PERSON[one.film] + one.seed, heading)
        decision = _decision(heading) if one.option("decided", False) else {}
        found = tracked(film, tracker=tracker_of("hybrid", **decision)).estimates
        errors.append([error for error in film_errors(film, found) if np.isfinite(error.yaw)])
    started = [known for known in errors if known]
    right = [known for known in started if known[-1].yaw <= REVERSED_DEG]
    joints = [float(np.mean([error.joints.mean() for error in known])) for known in right]
    return {
        "takes": len(headings),
        "started": len(started),
        "turned at first": sum(known[0].yaw > REVERSED_DEG for known in started),
        "turned round": len(started) - len(right),
        "yaw": float(np.mean([known[-1].yaw for known in right])),
        "joints": float(np.mean(joints)),
        "worst take": max(joints),
    }


def _decision(heading: int) -> dict[str, object]:
    away = {viewer: abs((heading - at + 180) % 360 - 180) for viewer, at in CAMERA_HEADINGS.items()}
    nearest = min(away, key=lambda viewer: away[viewer])
    return {"front": nearest} if away[nearest] < FACING_DEG else {"heading": 45.0 * round(heading / 45)}


def run_confidence(one: Case) -> Figures:
    """Stated and true frequency of one person's limbs (film `arms`, `legs`) or heading, by BINS.  Options: short."""
    stated, right = stored(lambda: _judged(one), one.seed, one.options, sources=(__name__,))[one.film]
    found = {"right": float(right.mean())}
    if 0 < right.mean() < 1:
        found["area under ROC"] = float(roc_auc_score(right, stated))
    for low, high in pairwise(BINS):
        inside = (stated >= low) & ((stated < high) | (high == 1.0))
        if inside.any():
            name = _range(low, high)
            values = {"share": inside.mean(), "stated": stated[inside].mean(), "true": right[inside].mean()}
            found |= {f"{name}: {what}": 100.0 * float(value) for what, value in values.items()}
    return found


def _judged(one: Case) -> Mapping[str, tuple[Floats, Bools]]:
    """Stated probabilities and whether they were right, of all films of a person."""
    who, short = CHECKED + one.seed, one.option("short", False)
    films = [posture_film(who, posture) for posture in (POSTURES[:1] if short else POSTURES)]
    if not short:
        films += [captured_film(who, motion) for motion in MOTIONS]
        films += [heading_film(who, heading) for heading in HEADINGS]
    stated: dict[str, list[float]] = {"arms": [], "legs": [], "heading": []}
    right: dict[str, list[bool]] = {"arms": [], "legs": [], "heading": []}
    for film in films:
        track = tracked(film)
        for pose in track.of(TrackerPose):
            true = film.truths[pose.frame]
            if true is None or pose.frame < film.motion_from or not pose.limbs or pose.heading is None:
                continue
            error = frame_error(track.estimates.get(pose.frame), true)
            limbs = list(pose.limbs.values())  # right and left arm, right and left leg
            for name, kept in (("arms", slice(0, 2)), ("legs", slice(2, 4))):
                stated[name] += limbs[kept]
                right[name] += limbs_right(error)[kept]
            stated["heading"].append(pose.heading)
            right["heading"].append(error.yaw < REVERSED_DEG)
    return {name: (np.array(stated[name]), np.array(right[name], dtype=bool)) for name in stated}


def _range(low: float, high: float) -> str:
    return f"{low:g} to {high:g}"


def run_limits(one: Case) -> Figures:
    """A scenario of one person.  Options: method, of `two_cameras.tracked_by`; size."""
    film, method = scenario(LIMITED + one.seed, one.film, one.option("size", "320x240")), one.option("method", "hybrid")
    track = tracked_by(method, film)
    errors = film_errors(film, track.estimates)
    right = np.array([limbs_right(error) for error in errors])
    found = {
        "wrong limbs": 100.0 * (1.0 - float(right.mean())),
        "joints": float(np.mean([min(error.joints.mean(), 1000.0) for error in errors])),
        "reversed": 100.0 * float(np.mean([error.yaw > REVERSED_DEG for error in errors])),
    }
    if one.film == "jump":
        waits = [np.flatnonzero(right[at : at + HELD].all(axis=1)) for at in (HELD, 2 * HELD)]
        found["again"] = max(float(well[0]) if len(well) else HELD for well in waits)
    better = true_pose_fits_better(film, track) if method == "hybrid" else []
    return found | ({"true fits better": 100.0 * float(np.mean(better))} if better else {})


def true_pose_fits_better(film: Film, track: Track) -> list[bool]:
    """In each frame with a wrong limb, whether the true pose of the tracked body, refined, has less misfit than the found
    one, refined alike: else no search for less misfit, however long, finds the limb."""
    setup = TrackerSetup(FOURTEEN_PARTS, film.cameras, round(1e9 / film.fps), None, Options())
    weights, better = residual_weights(setup, ESTIMATE_HOLD), list[bool]()
    masks: defaultdict[int, dict[str, Mask]] = defaultdict(dict)
    for one in track.of(Silhouette):
        masks[one.frame][one.viewer] = unpack(one.size, one.region, one.data)
    body = None
    for message in track.messages:
        if isinstance(message, TrackerBdp):
            body = bdp_of(setup.anatomy, message.body)
        if not isinstance(message, TrackerPose):
            continue
        true, found = film.truths[message.frame], track.estimates.get(message.frame)
        if true is None or found is None or body is None or message.frame < film.motion_from:
            continue
        if all(limbs_right(frame_error(found, true))):
            continue
        views = [masks[message.frame].get(view) for view in film.cameras]
        evidence, _ = evidence_of(*extract_outlines(views, list(film.cameras.values()), setup.options.points))
        (truth,) = poses_from_centres(setup.anatomy, {name: at[None] for name, at in true.joints.items()}, body)
        model, fits = model_of(setup.anatomy, body), list[float]()
        for pose in (truth, pose_of(setup.anatomy, message)):
            start = RootedPose.of(setup.anatomy, body, pose)
            refined = start.copy()
            refine(model, evidence, weights, ESTIMATE_ITERATIONS, refined, start)
            fits.append(float(misfit(model, evidence, weights.limit, refined)))
        better.append(fits[0] < fits[1])
    return better


def scenario(seed: int, name: str, size: str) -> Film:
    """Empty room, T-pose, arms lowered, then the scenario."""
    subject = person(seed)
    lowering = [interpolate(t_pose(subject), neutral(subject), k / LOWERING) for k in range(1, LOWERING + 1)]
    poses: list[PersonPose | None] = [None] * EMPTY
    poses += [t_pose(subject)] * STRETCHED + lowering
    return filmed(subject, [*poses, *SCENARIOS[name](subject)], len(poses), size_of(size), 1000 * seed)


def _arms(subject: Person, *angles: tuple[float, float, float, float]) -> PersonPose:
    """Standing with arms at abduction, flexion, outward rotation and elbow flexion in degrees: right, left."""
    return replace(neutral(subject), arms=np.radians(angles))


def _moves(poses: Sequence[PersonPose], moving: int) -> list[PersonPose]:
    """Each pose held for HELD frames, with `moving` frames from one to the next."""
    frames = [poses[0]] * HELD
    for before, after in pairwise(poses):
        frames += [interpolate(before, after, minimum_jerk(k / moving)) for k in range(1, moving)] + [after] * HELD
    return frames


def _jump(subject: Person) -> list[PersonPose]:
    hanging, raised = neutral(subject), _arms(subject, (120, 0, 0, 10), (120, 0, 0, 10))
    return _moves((hanging, raised, hanging), 1)


def _crossed(subject: Person) -> list[PersonPose]:
    before = _arms(subject, (10, 30, -70, 100), (10, 40, -70, 110))
    return _moves((neutral(subject), before, neutral(subject)), MOVING)


def _one_then_both(raised: tuple[float, float, float, float], subject: Person) -> list[PersonPose]:
    """The right arm at these angles, then both."""
    upper, flexed, turned, elbow = np.degrees(neutral(subject).arms[0]).tolist()
    one, both = _arms(subject, raised, (upper, flexed, turned, elbow)), _arms(subject, raised, raised)
    return _moves((neutral(subject), one, both, neutral(subject)), MOVING)


def _turn(subject: Person) -> list[PersonPose]:
    frames = 2 * HELD
    return [place(neutral(subject), Placement(yaw=2.0 * np.pi * k / frames)) for k in range(frames)]


SCENARIOS: Mapping[str, Callable[[Person], list[PersonPose]]] = {
    "jump": _jump, "crossed": _crossed, "turn": _turn, "side": partial(_one_then_both, (5, 85, 0, 5)),
    "half": partial(_one_then_both, (5, 45, 0, 5)), "bent": partial(_one_then_both, (5, 45, 0, 90)),
}  # fmt: skip
COUNTS = tuple(Quantity(name, digits=0, joined="sum") for name in ("takes", "started", "turned at first", "turned round"))
STARTS = Kind(
    "starts",
    "Starts of the tracker, two cameras at 160×120, four people: without a T-pose in the middle of a motion, and in the "
    "T-pose at every 15° of heading. Errors from 2 s after the first frame on; worst take of all people in brackets.",
    run,
    (
        *COUNTS,
        Quantity("after", "s", 1, joined="median"),
        Quantity("last", "s"),
        Quantity("yaw", "°"),
        Quantity("joints", "mm", 0),
        Quantity("worst take", "mm", 0),
    ),
    {
        f"{film}, {name}": case(film, t_pose=shown)
        for film in ("motions", "postures")
        for name, shown in (("any posture", False), ("after a T-pose", True))
    },
    case("postures", only="squat"),
    seeds=4,
    rows="films, start",
    inputs=lambda one: tuple(map(motion_file, MOTIONS)) if one.film == "motions" else (),
)
HEADING_STARTS = Kind(
    "headings",
    "Simulated people in the T-pose at every 15° of heading, two cameras at 160×120, four people; with the user's "
    "decision by `--front` or `--heading`, and without.",
    run_headings,
    STARTS.columns,
    {name: case("T-poses", decided=decided) for name, decided in (("undecided", False), ("decided by the user", True))},
    case("T-poses", every=180),
    seeds=4,
    rows="front",
)
CONFIDENCE = Kind(
    "confidence",
    "Probability that a limb (elbow and wrist, or knee and ankle, within 150 mm) and the heading (within 90°) are right, "
    "as each pose states it, against how often they are; four people who were not used for the fit, two cameras at "
    "160×120.",
    run_confidence,
    (
        Quantity("right", "", 2, "low"),
        Quantity("area under ROC", "", 2, "low"),
        *(
            Quantity(f"{_range(low, high)}: {what}", "%", 0, "")
            for low, high in pairwise(BINS)
            for what in ("share", "stated", "true")
        ),
    ),
    {name: case(name) for name in ("arms", "legs", "heading")},
    case("arms", short=True),
    seeds=4,
    rows="what",
    inputs=lambda one: () if one.option("short", False) else tuple(map(motion_file, MOTIONS)),
)
LIMITS = Kind(
    "limits",
    "Limits that [Two-view] admits, as scenarios of five simulated people, two cameras at 320×240. Wrong: limbs with "
    "a joint more than 150 mm off; reversed: frames with a heading more than 90° off; again: frames after a jump until "
    "all limbs are right; true fits better: frames with a wrong limb in which the true pose fits the silhouettes better "
    "than the found one.",
    run_limits,
    (
        Quantity("wrong limbs", "%"),
        Quantity("joints", "mm", 0),
        Quantity("reversed", "%", 1),
        Quantity("again", "frames", 0),
        Quantity("true fits better", "%", 0, ""),
    ),
    {
        f"{title}, {name}": case(film, method=method)
        for film, title in (
            ("jump", "arms raised within one frame"),
            ("crossed", "forearms before the chest"),
            ("side", "one arm forward, then both"),
            ("half", "one arm half raised, then both"),
            ("bent", "one bent arm, then both"),
            ("turn", "once around on the spot"),
        )
        for name, method in (
            ("two-view, paper", "paper"),
            ("two-view", "improved"),
            ("tracker without its searches", "hybrid-limb_search-other_postures-relocalization"),
            ("tracker", "hybrid"),
        )
    },
    case("jump", size="160x120"),
    seeds=5,
    rows="scenario, method",
)
