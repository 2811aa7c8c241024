"""Jitter, error and delay of the tracker's poses: as tracked, smoothed, tracked both ways."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import nan, radians

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.cases import clips
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import MOTIONS, Film, Size, captured_film, filmed, motion_file, size_of
from benchmarks.people.priors import prior_named
from benchmarks.people.simulated_clips import (
    CHAIN,
    FPS,
    STANDING,
    SimulatedClip,
    captured_clip,
    filmed_clip,
    performed_clip,
    performed_poses,
)
from benchmarks.people.tracker import ANATOMY, NAMES, PersonClip, TrackedPath, both_ways, track_clip
from tests.support.stored import stored
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.one_euro import Filtered, OneEuro, filtered
from zenocap.common.body.pose_rotations import pose_rotations
from zenocap.common.formats.pose_track import Bound, PoseTrack
from zenocap.common.formats.smoothing import DEFAULT_HZ, smoothed
from zenocap.services.tracker.states import Options, TrackerSetup
from zenocap.simulation.body.person import person
from zenocap.tools.judge.parameters import START_NS
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy

FIRST_PERSON, FIRST_OF_PAIRS, FIRST_MADE = 108, 540, 580
PERFORMED = ("boxing", "turning", "squat", "march", "raise-both-arms", CHAIN)
ALL, PAIRED = "all", (*MOTIONS, *PERFORMED)  # the films of pairs, each of another person
TURNED = radians(45)
ERRORS = (("mean", "mm", 0), ("shape", "mm", 0), ("lost", "%", 1), ("shoulders turned", "%", 1))
MAX_LAG = 8  # frames
CUT_OFF = f"{DEFAULT_HZ:g} Hz"
SMOOTHINGS = ("as tracked", "one-euro", CUT_OFF, "both ways", f"both ways, {CUT_OFF}")


def run(one: Case) -> Figures:
    """Figures of one person, the mean over the motions, or of a shared clip.

    Options: smoothing, of SMOOTHINGS; views.
    """
    films = [one.film] if one.film != "motions" else list(MOTIONS)
    return _joined([_figures(*_track(one, film)) for film in films])


def run_pairs(one: Case) -> Figures:
    """Errors of one film, or the means over PAIRED, both ways and live.  Options: see `_pair`."""
    key = one.seed, one.options
    return _joined([stored(partial(_pair, film, one), film, *key, sources=(__name__,)) for film in _films(one)])


def _films(one: Case) -> Sequence[str]:
    return PAIRED if one.film == ALL else (one.film,)


def _joined(found: Sequence[Mapping[str, float]]) -> dict[str, float]:
    columns = dict.fromkeys(name for figures in found for name in figures)
    means = {name: float(np.mean([figures[name] for figures in found if name in figures])) for name in columns}
    return means | {"worst take": max(figures.get("mean", nan) for figures in found)}


def _track(one: Case, film: str) -> tuple[PoseTrack | None, PersonClip]:
    """The smoothed track of a film, None without a pose."""
    smoothing, views = one.option("smoothing", SMOOTHINGS[0]), one.option("views", 2)
    if film not in (*MOTIONS, STANDING):
        shared = Case(film, one.seed).with_options(views=views if film in clips.SEVEN else 7, both_ways="both" in smoothing)
        clip, path = clips.film_of(shared), clips.tracked(shared)
    else:
        clip = captured_clip(FIRST_PERSON + one.seed, film, views)
        key = (film, one.seed, views, "both" in smoothing)
        path = stored(lambda: _tracked(clip, both="both" in smoothing), *key, sources=(__name__,))
    track = _posed(path, clip)
    if track is None:
        return None, clip
    if smoothing == "one-euro":
        return live(track), clip
    return (smoothed(track, DEFAULT_HZ) if CUT_OFF in smoothing else track), clip


def _posed(path: TrackedPath, clip: PersonClip) -> PoseTrack | None:
    """The poses from the first one on."""
    if not path.poses:
        return None
    frames = range(min(path.poses), int(clip.truth.frames[-1]) + 1)
    return track_of(path.body, frames, [path.poses[k][1] if k in path.poses else None for k in frames], clip.truth.rate)


def _tracked(clip: PersonClip, *, both: bool) -> TrackedPath:
    setup = TrackerSetup(ANATOMY, clip.cameras, clip.frame_ns, prior_named("general"), Options())
    path = track_clip(clip, setup)
    return both_ways(clip, setup, path) if both else path


def _pair(film: str, one: Case) -> dict[str, float]:
    """Errors of one film.  Options: views; t_pose; prior, by default none; first, the person of the first of PAIRED.

    made: size of two videos with noise, whose silhouettes the viewers find; by default exact silhouettes.
    """
    made = one.option("made", "")
    who = one.option("first", FIRST_MADE if made else FIRST_OF_PAIRS) + (PAIRED.index(film) if film in PAIRED else 0)
    exact = performed_clip if film in PERFORMED else captured_clip
    whole = filmed_clip(_film(who, film, size_of(made)), who) if made else exact(who, film, one.option("views", 2))
    clip = whole if one.option("t_pose", True) else without_t_pose(whole)
    setup = TrackerSetup(ANATOMY, clip.cameras, clip.frame_ns, prior_named(one.option("prior", "")), Options(seed=one.seed))
    forward, found = track_clip(clip, setup), dict[str, float]()
    for which, path in (("", both_ways(clip, setup, forward)), ("live ", forward)):
        figures = _figures(_posed(path, clip), clip)
        found |= {f"{which}{name}": figures[name] for name, *_ in ERRORS if name in figures}
    return found


def _film(who: int, film: str, size: Size) -> Film:
    if film not in PERFORMED:
        return captured_film(who, film, size)
    subject = person(who)
    return filmed(subject, *performed_poses(subject, film), size, 1000 * who, FPS)


def without_t_pose(clip: SimulatedClip) -> SimulatedClip:
    """The clip from the motion on, of which the first START_NS are not scored, as for the verdict."""
    kept = tuple(one for one in clip.instants if one.frame >= clip.motion_from)
    return replace(clip, instants=kept, motion_from=clip.motion_from + round(START_NS / clip.frame_ns))


def track_of(body: Bdp, frames: Sequence[int], poses: Sequence[Pose | None], rate: float) -> PoseTrack:
    positions = np.array([np.full(3, nan) if pose is None else pose.position for pose in poses])
    angles = np.array([np.full(len(ANATOMY.angles), nan) if pose is None else pose.angles for pose in poses])
    lost = tuple("person" if pose is None else "" for pose in poses)
    numbers = np.array(frames, dtype=np.int64)
    return PoseTrack(ANATOMY, body, numbers, numbers / rate, positions, angles, {}, {}, lost, rate)


def live(track: PoseTrack) -> PoseTrack:
    """The track smoothed pose by pose, as the animator does."""
    last: Filtered | None = None
    poses: list[Pose | None] = []
    for row, time_s in enumerate(track.times_s):
        if track.lost[row]:
            last = None
            poses.append(None)
        else:
            last, pose = filtered(ANATOMY, OneEuro(), last, round(1e9 * time_s), track.pose(row))
            poses.append(pose)
    return track_of(track.bdp, track.frames.tolist(), poses, track.rate)


def _figures(track: PoseTrack | None, clip: PersonClip) -> dict[str, float]:
    if track is None:
        return {"lost": 100.0}
    truth, rate = clip.truth, clip.truth.rate
    joints = track.trajectories()
    names = [name for name in NAMES if name in truth.names]
    found, rows = np.full((len(truth.frames), len(NAMES), 3), nan), {int(k): row for row, k in enumerate(joints.frames)}
    for k, frame in enumerate(truth.frames):
        if int(frame) in rows:
            found[k] = joints.points[rows[int(frame)]]
    scored = truth.frames >= clip.motion_from
    found = found[scored][:, [NAMES.index(name) for name in names]]
    exact = truth.points[scored][:, [truth.names.index(name) for name in names]]
    accelerations = np.linalg.norm(np.diff(found - exact, 2, axis=0), axis=-1) * rate**2
    if not np.isfinite(accelerations).any():
        return {"lost": 100.0}
    score = accuracy(joints, truth, ScoredFrames(first=Bound(clip.motion_from)))
    moved = float(np.ptp(exact, axis=0).max()) > 0.0
    shoulders = [names.index("LShoulder"), names.index("RShoulder")]
    drift, step = (nan, nan) if moved else jitter_deg(track, clip.motion_from)
    return {
        "acceleration": float(np.nanmean(accelerations)),
        "mean": score.mpjpe_mm,
        "shape": score.shape_mm,
        "lost": score.lost_pct,
        "shoulders turned": turned_pct(*(points[:, shoulders] for points in (found, exact))),
        **({"delay": 1e3 * lag_s(found, exact, rate)} if moved else {"drift": drift, "step": step}),
    }


def turned_pct(found: Floats, true: Floats) -> float:
    """Share of frames whose line of shoulders is more than 45° off, seen from above.  (frames, 2, 3): left, right."""
    across, expected = (points[:, 0, ::2] - points[:, 1, ::2] for points in (found, true))  # X and Z
    cosine = np.sum(across * expected, axis=1) / (np.linalg.norm(across, axis=1) * np.linalg.norm(expected, axis=1))
    return 100.0 * float(np.mean(cosine < np.cos(TURNED)))


def lag_s(found: Floats, exact: Floats, rate: float) -> float:
    """Delay (s) of joints (n, joints, 3) with the greatest correlation of velocities; between frames by a parabola.

    NaN without enough frames.
    """
    moved, expected = np.diff(found, axis=0), np.diff(exact, axis=0)
    known = np.flatnonzero(~np.isnan(moved[:, 0, 0]))
    times: Ints = known[(known >= MAX_LAG) & (known < len(moved) - MAX_LAG)]
    if not len(times):
        return nan
    correlations = []
    for lag in range(-MAX_LAG, MAX_LAG + 1):
        one, other = moved[times].ravel(), expected[times - lag].ravel()
        correlations.append(float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other)))
    best = int(np.clip(np.argmax(correlations), 1, 2 * MAX_LAG - 1))
    left, middle, right = correlations[best - 1 : best + 2]
    return (best - MAX_LAG + 0.5 * (left - right) / (left - 2.0 * middle + right)) / rate


def jitter_deg(track: PoseTrack, first: int) -> tuple[float, float]:
    """RMS turn of all joints and the root about their mean, and from frame to frame, degrees, from frame `first` on."""
    rows = track.known & (track.frames >= first)
    rotations = pose_rotations(ANATOMY, track.positions[rows], track.angles[rows])
    squares, steps = [], []
    for ball in range(rotations.quaternions.shape[1]):
        turns = Rotation.from_quat(rotations.quaternions[:, ball])
        squares.append(np.mean((turns.mean().inv() * turns).magnitude() ** 2))
        steps.append(np.mean((turns[:-1].inv() * turns[1:]).magnitude() ** 2))
    squares += [np.var(hinge) for hinge in rotations.hinges.T]
    steps += [np.mean(np.diff(hinge) ** 2) for hinge in rotations.hinges.T]
    return float(np.degrees(np.sqrt(np.mean(squares)))), float(np.degrees(np.sqrt(np.mean(steps))))


def inputs(one: Case) -> tuple[str, ...]:
    if one.film == STANDING:
        return ()
    return tuple(map(motion_file, MOTIONS)) if one.film == "motions" else (f"clips/{one.film}",)


_SHARED = {"walk2": 2, "bend2": 2, "kick2": 2, "turned2": 2, "walk7": 3, "jog7": 3, "box7": 3}
JITTER = Kind(
    "jitter",
    "The tracker on five simulated people with motion capture at 30 frames/s and 320×240, standing still, and on the "
    "shared clips. Acceleration: mean length of the difference to the truth's. Delay: the one with the greatest "
    "correlation of the joints' velocities with the truth's. Step: RMS turn of the joints from one frame to the next of a "
    "person who stands.",
    run,
    (
        Quantity("acceleration", "m/s²"),
        Quantity("mean", "mm", 0),
        Quantity("worst take", "mm", 0),
        Quantity("shape", "mm", 0),
        Quantity("lost", "%"),
        Quantity("shoulders turned", "%"),
        Quantity("delay", "ms", 0),
        Quantity("step", "°"),
        Quantity("drift", "°"),
    ),
    {
        f"{film}, {views} views, {smoothing}": case(film, views=views, smoothing=smoothing)
        for film in ("motions", STANDING)
        for views in (2, 4)
        for smoothing in SMOOTHINGS
    }
    | {
        f"{film}, {views} views, {smoothing}": case(film, views=views, smoothing=smoothing)
        for film, views in _SHARED.items()
        for smoothing in SMOOTHINGS
    },
    case(STANDING),
    seeds=5,
    rows="film, views, poses",
    inputs=inputs,
)
PAIRS = Kind(
    "pairs",
    "The tracker without motion prior on twelve simulated people, half of them with motion capture, at 30 frames/s and "
    "320×240, both ways and live. No T-pose: seen from the motion on, whose first 1.5 s do not count. Shoulders "
    "turned: by more than 45°, seen from above. Made: videos (H.264) of that size with noise of 3 grey levels.",
    run_pairs,
    (
        *(Quantity(f"{which}{name}", unit, digits) for which in ("", "live ") for name, unit, digits in ERRORS),
        Quantity("worst take", "mm", 0),
    ),
    {
        f"{film}, {views} views, {start}": case(film, views=views, t_pose=shown)
        for film, views in ((ALL, 2), (ALL, 3), (ALL, 4), (ALL, 7), *((film, 2) for film in PAIRED))
        for start, shown in (("after a T-pose", True), ("no T-pose", False))
        if shown or views == 2
    }
    | {"all, made at 160×120, 2 views, after a T-pose": case(ALL, views=2, made="160x120")},
    case("squat", t_pose=False),
    rows="film, views, start",
    inputs=lambda one: tuple(motion_file(film) for film in _films(one) if film not in PERFORMED),
)
