"""Silhouettes with and without the tracker's pose fed back to the viewers."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from benchmarks.cases.rooms.film import FPS, RoomFrame, RoomScene, shots
from benchmarks.cases.rooms.silhouettes import NAMED, OVERLAP, SETTLED_S, OverlapScore
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.session import rig_of, stepped
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.conversion import bdp_of, pose_of, silhouette_mask
from zenocap.common.messages import Silhouette, TrackerBdp, TrackerPose
from zenocap.common.rig.sources import parse_background
from zenocap.services.viewer.frame import Frame
from zenocap.simulation.ground_truth import landmarks
from zenocap.tools.parameters import EPOCH_NS

FIRST_SEED = 2  # constants were chosen by hand on 0 and 1
SIZE, VIEWS = (320, 240), ("cam01", "cam02")
NAMES = [marker.name for marker in FOURTEEN_PARTS.markers]


def run(one: Case) -> Figures:
    """Figures of one seed.  Options: feedback."""
    scenes = {view: RoomScene(FIRST_SEED + one.seed, SIZE, len(VIEWS), view) for view in VIEWS}
    situation, first = NAMED[one.film], scenes["cam01"]
    subject = first.walker.person if situation.dressed is None else situation.dressed(first)
    films = {view: list(shots(scene, situation)) for view, scene in scenes.items()}
    cameras = {view: scene.camera for view, scene in scenes.items()}
    background = parse_background("adaptive", Path())
    rig = rig_of(cameras, background, FPS, "hybrid", feedback=one.option("feedback", False))
    score, joints, body = OverlapScore(), list[float](), None
    for number, messages in enumerate(stepped(rig, _frames(films))):
        masks = {each.viewer: silhouette_mask(each) for each in messages if isinstance(each, Silhouette)}
        bodies = [each for each in messages if isinstance(each, TrackerBdp)]
        body = bdp_of(FOURTEEN_PARTS, bodies[-1].body) if bodies else body
        shown = {view: film[number] for view, film in films.items()}
        if shown["cam01"].time_s < situation.first_s + SETTLED_S or (pose := shown["cam01"].pose) is None:
            continue
        for view, shot in shown.items():
            score.add(masks.get(view), shot.truth)
        poses = [each for each in messages if isinstance(each, TrackerPose)]
        joints.append(_error_mm(body, poses[-1] if poses else None, landmarks(subject, pose)))
    known = np.isfinite(joints)
    return score.figures() | {
        "joints": float(np.mean(np.array(joints)[known])) if known.any() else float("nan"),
        "lost": 100.0 * (1.0 - float(known.mean())),
    }


def _frames(films: Mapping[str, list[RoomFrame]]) -> Iterator[Mapping[str, Frame]]:
    for k in range(min(map(len, films.values()))):
        yield {view: Frame(k, EPOCH_NS + round(film[k].time_s * 1e9), film[k].image) for view, film in films.items()}


def _error_mm(body: Bdp | None, pose: TrackerPose | None, true: Mapping[str, Floats]) -> float:
    """Mean distance of the joints, mm; infinite without a pose."""
    if pose is None or pose.lost or body is None:
        return float("inf")
    found = joint_centres(FOURTEEN_PARTS, body, pose_of(FOURTEEN_PARTS, pose))
    return 1e3 * float(np.mean([np.linalg.norm(found[k] - true[name]) for k, name in enumerate(NAMES) if name in true]))


FEEDBACK = Kind(
    "feedback",
    "Films as of `rooms`, two views of each seed and the tracker with a body of average proportions, without and with "
    "`feedback = true` of the viewers; lost: instants without a pose.",
    run,
    (*OVERLAP, Quantity("joints", "mm", 0), Quantity("lost", "%", 0)),
    {
        f"{name}, {words}": case(name, feedback=on)
        for name in NAMED
        for words, on in (("without", False), ("with feedback", True))
    },
    case("empty room first"),
    seeds=6,
    rows="situation, feedback",
)
