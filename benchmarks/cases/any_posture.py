"""Starts without a T-pose: on the floor, standing turned, walking; with seeds and decisions."""

from collections.abc import Sequence
from math import ceil, nan, radians

import numpy as np

from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from benchmarks.people.captured import between, captured_take
from benchmarks.people.films import motion_file, size_of
from benchmarks.people.simulated_clips import FPS, STANDING, SimulatedClip, simulated_clip
from benchmarks.people.tracker import ANATOMY, NAMES, TrackedPath, track_clip
from tests.support.floor_people import FLOOR, on_floor
from zenocap.common.arrays import Floats
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker.states import Options, TrackerSetup
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement, minimum_jerk, neutral, place
from zenocap.simulation.body.skeleton import Bones, pose_bones

FIRST_PERSON, WALK = 560, "10_01"
EMPTY = 2  # frames before the person
SETTLED_S, HELD_S, RISING_S, STANDING_S = 2.0, 3.0, 1.5, 0.5  # scored from SETTLED_S on


def run(one: Case) -> Figures:
    """Starts of one person.  Options: first, person of seed 0; tracks, of equal films with other seeds; views; size."""
    subject, tracks = person(one.option("first", FIRST_PERSON) + one.seed), one.option("tracks", 3)
    after, joints, spreads, worse = list[float](), list[float](), list[float](), list[float]()
    for degrees in (45 * one.seed, 45 * one.seed + 180) if one.film == STANDING else (45 * one.seed + 20,):
        heading = radians(degrees)
        clip = _clip(one, subject, heading)
        paths = [_track(clip, Options(seed=seed)) for seed in range(tracks)]
        decided = [_track(clip, Options(seed=seed, heading=heading)) for seed in range(tracks)]
        after += [(min(path.poses) - EMPTY) / FPS for path in paths if path.poses]
        found, by_user = (np.array([_joints(path, clip) for path in some]) for some in (paths, decided))
        joints.append(_mean_error(found, clip))
        worse.append(_mean_error(by_user, clip) - joints[-1])
        spreads.append(spread(found))
    return {
        "takes": tracks * len(joints), "started": len(after),
        "after": float(np.median(after)) if after else nan, "last": max(after, default=nan),
        "joints": float(np.mean(joints)), "seeds apart": max(spreads), "worse by decision": max(worse),
    }  # fmt: skip


def _clip(one: Case, subject: Person, heading: float) -> SimulatedClip:
    poses = film_poses(subject, one.film, heading)
    first, size = EMPTY + round(SETTLED_S * FPS), size_of(one.option("size", "320x240"))
    return simulated_clip(subject, [poses[0]] * EMPTY + [*poses], first, FPS, one.option("views", 2), size)


def film_poses(subject: Person, film: str, heading: float) -> Sequence[PersonPose | Bones | None]:
    """A person who holds a posture of FLOOR and stands up, or walks from the start on, or stands; heading in radians."""
    if film == WALK:
        take = captured_take(subject, SHARED / motion_file(film), FPS, longest_s=HELD_S + RISING_S, heading=heading)
        return take.poses[take.motion_from :]
    up, held, rising = place(neutral(subject), Placement(yaw=heading)), ceil(HELD_S * FPS), ceil(RISING_S * FPS)
    if film == STANDING:
        return [up] * (held + rising)
    low, high = on_floor(subject, film, heading), pose_bones(subject, up)
    shares = [0.0] * held + [k / rising for k in range(1, rising)] + [1.0] * ceil(STANDING_S * FPS)
    return [between(low, high, minimum_jerk(share)) for share in shares]


def _track(clip: SimulatedClip, options: Options) -> TrackedPath:
    setup = TrackerSetup(ANATOMY, clip.cameras, clip.frame_ns, None, options)
    return track_clip(clip, setup, empty=range(EMPTY))


def _joints(path: TrackedPath, clip: SimulatedClip) -> Floats:
    """(frames, joints, 3) of the scored frames, metres; NaN without a pose."""
    found = np.full((len(clip.truth.frames), len(NAMES), 3), nan)
    for frame, (body, pose) in path.poses.items():
        found[frame] = joint_centres(ANATOMY, body, pose)
    return found[clip.motion_from :]


def _mean_error(found: Floats, clip: SimulatedClip) -> float:
    """Mean error of joints (tracks, frames, joints, 3), mm; NaN without a pose."""
    true = clip.truth.points[clip.motion_from :, [clip.truth.names.index(name) for name in NAMES]]
    errors = np.linalg.norm(found - true, axis=-1)
    known = errors[~np.isnan(errors)]
    return 1e3 * float(known.mean()) if known.size else nan


def spread(found: Floats) -> float:
    """Mean distance in mm of joints (tracks, frames, joints, 3) from their mean, in frames that all have; else NaN."""
    shared = found[:, ~np.isnan(found).any(axis=(0, 2, 3))]
    return 1e3 * float(np.linalg.norm(shared - shared.mean(axis=0), axis=-1).mean()) if shared.size else nan


ANY_POSTURE = Kind(
    "any-posture",
    "Starts without a T-pose, two cameras, silhouettes of 320×240, four people: on the floor for 3 s, then rising; "
    "standing; walking. Three tracks of each film with other seeds, and with the true `--heading`; errors from 2 s on.",
    run,
    (
        *(Quantity(name, digits=0, joined="sum") for name in ("takes", "started")),
        Quantity("after", "s", joined="median"),
        Quantity("last", "s"),
        *(Quantity(name, "mm", 0) for name in ("joints", "seeds apart", "worse by decision")),
    ),
    {film: case(film) for film in (*FLOOR, STANDING)} | {"walking": case(WALK)},
    case("crouching", tracks=1, size="160x120"),
    seeds=4,
    rows="posture",
    inputs=lambda one: (motion_file(one.film),) if one.film == WALK else (),
)
