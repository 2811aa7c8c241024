"""Four limits that [Two-view] admits, each as a scenario of simulated people: the paper's method, ours, and the tracker.

    python -m benchmarks.limits [--people 5] [--first-person 60] [--size 320x240] [--jobs 2]

jump: both arms are raised within one frame and lowered after two seconds: errors must not propagate.
crossed: forearms before the chest: limbs whose silhouette is inside that of the torso.
side: one arm forward, then both, in the flank of one camera: one arm or two.
turn: once around on the spot: front or back.
Two cameras of the paper at 15 frames/s.  wrong: share of limbs (arms and legs) with a joint more than 150 mm off, %.
front: share of frames whose heading is more than 90 degrees off, %.  again: frames after a jump until all limbs are right,
median; "never" counts as the rest of the scenario.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from multiprocessing import Pool

import cv2
import msgspec
import numpy as np

from benchmarks.errors import JOINTS, Estimate, frame_error
from benchmarks.loop import track_film, tracker_film
from benchmarks.table import Cell, table
from benchmarks.takes import FPS, VIEWERS, Film, Size
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.rig.tracker import DEFAULT_FILTER
from zenocap.common.rig.two_view import IMPROVED, PAPER
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement, interpolate, minimum_jerk, neutral, place
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

EMPTY, STRETCHED, LOWERING, HELD, MOVING = 15, 20, 10, 30, 9  # frames
LIMBS = (("RElbow", "RWrist"), ("LElbow", "LWrist"), ("RKnee", "RAnkle"), ("LKnee", "LAnkle"))
WRONG_MM, REVERSED_DEG = 150.0, 90.0
NO_SEARCH = msgspec.structs.replace(DEFAULT_FILTER, limb_search=False, other_postures=False, relocalization=False)


def arms(subject: Person, *angles: tuple[float, float, float, float]) -> PersonPose:
    """Standing with arms at abduction, flexion, outward rotation and elbow flexion in degrees: right, left."""
    return replace(neutral(subject), arms=np.radians(angles))


def moves(poses: Sequence[PersonPose], moving: int) -> list[PersonPose]:
    """Each pose held for HELD frames, with `moving` frames from one to the next."""
    frames = [poses[0]] * HELD
    for before, after in pairwise(poses):
        frames += [interpolate(before, after, minimum_jerk(k / moving)) for k in range(1, moving)] + [after] * HELD
    return frames


def jump(subject: Person) -> list[PersonPose]:
    hanging, raised = neutral(subject), arms(subject, (120, 0, 0, 10), (120, 0, 0, 10))
    return moves((hanging, raised, hanging), 1)


def crossed(subject: Person) -> list[PersonPose]:
    before = arms(subject, (10, 30, -70, 100), (10, 40, -70, 110))
    return moves((neutral(subject), before, neutral(subject)), MOVING)


def side(subject: Person) -> list[PersonPose]:
    rest, forward = tuple(np.degrees(neutral(subject).arms[0])), (5, 85, 0, 5)
    one, both = arms(subject, forward, rest), arms(subject, forward, forward)
    return moves((neutral(subject), one, both, neutral(subject)), MOVING)


def turn(subject: Person) -> list[PersonPose]:
    frames = 2 * HELD
    return [place(neutral(subject), Placement(yaw=2.0 * np.pi * k / frames)) for k in range(frames)]


SCENARIOS: Mapping[str, Callable[[Person], list[PersonPose]]] = {
    "jump": jump,
    "crossed": crossed,
    "side": side,
    "turn": turn,
}
METHODS: Mapping[str, Callable[[Film], Mapping[int, Estimate]]] = {
    "two-view, paper": lambda film: _two_view(film, paper=True),
    "two-view": lambda film: _two_view(film, paper=False),
    "tracker without its searches": lambda film: tracker_film(film, FPS, filter=NO_SEARCH),
    "tracker": lambda film: tracker_film(film, FPS),
}


def _two_view(film: Film, *, paper: bool) -> Mapping[int, Estimate]:
    track = track_film(film, FPS, PAPER if paper else IMPROVED)
    every = {k: track.estimate(k) for k in range(len(film.truths))}
    return {k: one for k, one in every.items() if one is not None}


def scenario_film(seed: int, name: str, size: Size) -> Film:
    """Empty room, T-pose, arms lowered, then the scenario."""
    subject = person(seed)
    lowering = [interpolate(t_pose(subject), neutral(subject), k / LOWERING) for k in range(1, LOWERING + 1)]
    poses: list[PersonPose | None] = [None] * EMPTY
    poses += [t_pose(subject)] * STRETCHED + lowering
    start = len(poses)
    poses += SCENARIOS[name](subject)
    cameras = dict(zip(VIEWERS, paper_cameras(size), strict=True))
    images = {}
    for viewer, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 1000 * seed)
        images[viewer] = np.stack([renderer.render(pose, k) for k, pose in enumerate(poses)])
    truths = tuple(None if pose is None else truth(subject, pose) for pose in poses)
    return Film(cameras, images, truths, EMPTY, start)


@dataclass(frozen=True)
class Result:
    """wrong, reversed: shares.  joints: mean error, mm.  again: frames from a jump until all limbs are right."""

    wrong: float
    reversed: float
    joints: float
    again: tuple[int, ...]


def measured(job: tuple[int, str], size: Size) -> list[Result]:
    """Of METHODS."""
    cv2.setNumThreads(1)
    film = scenario_film(*job, size)
    return [_result(film, method(film), job[1]) for method in METHODS.values()]


def _result(film: Film, found: Mapping[int, Estimate], name: str) -> Result:
    right, reversed_, joints = [], [], []
    for k in range(film.motion_from, len(film.truths)):
        true = film.truths[k]
        assert true is not None
        error = frame_error(found.get(k), true)
        right.append([all(error.joints[JOINTS.index(joint)] < WRONG_MM for joint in limb) for limb in LIMBS])
        reversed_.append(error.yaw > REVERSED_DEG)
        joints.append(min(error.joints.mean(), 1000.0))
    jumps = (HELD, 2 * HELD) if name == "jump" else ()
    again = []
    for at in jumps:
        well = np.flatnonzero(np.all(right[at : at + HELD], axis=1))
        again.append(int(well[0]) if len(well) else HELD)
    return Result(1.0 - float(np.mean(right)), float(np.mean(reversed_)), float(np.mean(joints)), tuple(again))


def row(name: str, method: str, results: Sequence[Result]) -> list[Cell]:
    wrong = [100.0 * one.wrong for one in results]
    again = [frames for one in results for frames in one.again]
    return [
        name,
        method,
        f"{np.mean(wrong):.1f} ({max(wrong):.1f})",
        f"{np.mean([one.joints for one in results]):.0f} ({max(one.joints for one in results):.0f})",
        f"{100.0 * np.mean([one.reversed for one in results]):.1f}",
        f"{np.median(again):.0f} ({max(again)})" if again else "–",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--first-person", type=int, default=60)
    parser.add_argument("--size", default="320x240", metavar="WxH")
    parser.add_argument("--scenario", nargs="+", choices=list(SCENARIOS), default=list(SCENARIOS), metavar="NAME")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    width, height = (int(number) for number in options.size.split("x"))
    people = range(options.first_person, options.first_person + options.people)
    jobs = [(seed, name) for name in options.scenario for seed in people]
    with Pool(options.jobs) as pool:
        found = pool.map(partial(measured, size=(width, height)), jobs, chunksize=1)
    rows = [
        row(name, method, [one[k] for one, job in zip(found, jobs, strict=True) if job[1] == name])
        for name in options.scenario
        for k, method in enumerate(METHODS)
    ]
    columns = ("scenario", "method", "wrong limbs % (worst)", "joints mm (worst)", "front %", "again, frames (last)")
    print(table(f"Four limits, {options.people} people, {options.size}, worst person in brackets", columns, rows))


if __name__ == "__main__":
    main()
