"""Held steps, one foot before the other: exchanged legs, and the probability stated of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.cases.verdict.takes import FPS, FaultyTake, scene_of, tracker_messages
from benchmarks.cases.verdict.truth import TrueError, found_joints, scored, true_error
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import motion_file, size_of
from benchmarks.people.simulated_clips import STANDING, held_clip
from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats
from zenocap.simulation.body.pose import RIGHT
from zenocap.tools.judge.evidence import TakeEvidence, evidence_of
from zenocap.tools.judge.verdict import verdict_of

FIRST_PERSON = 500
HEADINGS = range(0, 360, 60)  # degrees
MOTIONS = ("07_01", "02_08", STANDING)  # after the step: a walk, sweeping, the step to the end
LEGS, OTHER_LEG = ("RKnee", "RAnkle", "LKnee", "LAnkle"), [2, 3, 0, 1]
FIGURES = (("mean", "mm", 0), ("lost", "%", 1), ("legs exchanged", "%", 1), ("legs then", "", 2))


def takes(first: int, motions: Sequence[str], views: int = 2) -> dict[str, Case]:
    """Six headings of each motion, each take of another person from `first` on, with and without a T-pose."""
    return {
        f"{heading}°, {motion}, {views} views, {start}": case(
            motion, person=first + len(HEADINGS) * group + k, heading=heading, ahead=(group + k) % 2, views=views,
            t_pose=t_pose,
        )
        for group, motion in enumerate(motions)
        for k, heading in enumerate(HEADINGS)
        for start, t_pose in (("after a T-pose", True), ("no T-pose", False))
    }  # fmt: skip


def run(one: Case) -> Figures:
    """Figures of one take.  Options: person, heading, ahead (see `held_clip`), views, size, t_pose."""
    take = _tracked(one)
    evidence = evidence_of(take.messages)
    live = _figures(take, replace(evidence, both={}), m.TrackerPose)
    called_good = verdict_of(evidence).rating == "good"
    return {
        **_figures(take, evidence, m.BothWaysPose),
        **{f"live {name}": value for name, value in live.items()},
        "wrongly good": called_good and true_error(take, evidence).rating != "good",
    }


def _tracked(one: Case) -> FaultyTake:
    clip = held_clip(
        one.option("person", FIRST_PERSON), one.option("heading", 0), one.option("ahead", RIGHT), one.film,
        one.option("views", 2), FPS, size_of(one.option("size", "320x240")),
    )  # fmt: skip
    scene = scene_of(clip, {})
    shown = scene if one.option("t_pose", True) else replace(scene, first=clip.motion_from)
    rows = clip.truth.frames >= clip.motion_from
    messages = tuple(tracker_messages(shown, one.seed))
    return FaultyTake(messages, clip.truth.names, clip.truth.frames[rows], clip.truth.points[rows])


def _figures(take: FaultyTake, evidence: TakeEvidence, kind: type[m.TrackerPose]) -> dict[str, float]:
    """Errors of the poses of the evidence.  kind: of their messages."""
    rows, legs = scored(take), [take.names.index(name) for name in LEGS]
    found, true = found_joints(take, evidence)[rows], take.points[rows]
    errors, wrong = TrueError(np.linalg.norm(found - true, axis=2)), exchanged(found[:, legs], true[:, legs])
    stated = {one.frame: one.limbs for one in take.messages if isinstance(one, m.TrackerPose) and type(one) is kind}
    limbs = [stated.get(frame, {}) for frame in take.frames[rows][wrong].tolist()]
    scores = [limb[leg] for limb in limbs for leg in ("right_leg", "left_leg") if leg in limb]
    return {
        "mean": 1e3 * errors.mean,
        "lost": 100.0 * errors.lost,
        "legs exchanged": 100.0 * float(wrong.mean()),
        **({"legs then": float(np.mean(scores))} if scores else {}),
    }


def exchanged(found: Floats, true: Floats) -> Bools:
    """(frames,) whether LEGS, (frames, 4, 3), are less than half as far from the other leg's joints as from their own."""
    own, other = (np.linalg.norm(found - joints, axis=2).sum(axis=1) for joints in (true, true[:, OTHER_LEG]))
    nearer: Bools = 2.0 * other < own
    return nearer


HELD = Kind(
    "held",
    "A step held for 3 s, one foot 35 cm before the other, then a walk, sweeping, or the step to the end; another person "
    "each, silhouettes of 320×240, the first 1.5 s in view not counted. Legs then: their stated probability while "
    "exchanged. Live: as tracked; the others both ways.",
    run,
    (
        *(Quantity(f"{live}{name}", unit, digits) for live in ("", "live ") for name, unit, digits in FIGURES),
        Quantity("wrongly good", "takes", 0, joined="sum"),
    ),
    takes(FIRST_PERSON, MOTIONS) | takes(FIRST_PERSON, MOTIONS[:1], 3),
    case(STANDING, t_pose=False),
    rows="heading, then, views, start",
    inputs=lambda one: () if one.film == STANDING else (motion_file(one.film),),
)
