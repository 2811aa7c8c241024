"""`zenocap warmup`: run everything that is compiled once, so that later processes load it instead of compiling.

A model of the body is drawn, tracked and thrown away; nothing of it depends on a camera, a file or the actor.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from common.actor.person import person
from common.actor.render import ActorCamera
from common.actor.script import stretched
from common.actor.truth import true_bdp
from common.body.anatomy import TEN_PARTS
from common.body.definition import Pose, neutral_pose
from common.body.kinematics import part_frames
from common.body.surface import end_ellipses
from common.bus.local import LocalNetwork
from common.camera.pinhole import Camera
from common.runtime.clock import ManualClock
from common.runtime.rig import Rig, Viewer
from common.runtime.rig_file import LogTable, ZenohTable
from common.runtime.specs import FirstFrames, VideoFile
from common.runtime.tracker_table import TrackerTable, tracker_spec
from common.vision.background import learn, update
from common.vision.silhouette import SilhouetteOptions, extract
from services.animator.render.ready import load_compiled as load_compiled_pictures
from services.recognizer.ready import load_compiled as load_compiled_recognizer
from services.recognizer.ready import stand_in
from services.recognizer.stream import plan_of
from services.takes.offline import Offline
from services.takes.track import EPOCH_NS
from services.tracker.prior.passes import expectation
from services.tracker.ready import load_compiled as load_compiled_tracker
from services.tracker.shell import tracker_service
from services.viewer.ready import load_compiled
from services.viewer.sources.frame import Frame, Image
from services.viewer.states import viewer_setup

# The first is as long as the next two together, and best goes beside them; a two-view rig does without the tracker.
# A rig that runs draws no pictures: those are of `zenocap animator TAKE --render`.
PARTS = ("tracking", "silhouettes", "actor", "tracker", "recognizer", "pictures")
EMPTY, STILL, MOVING, AWAY = 4, 14, 6, 4  # frames of the empty scene, the initial posture, lowering the arms, a jump
FPS = 15.0
SIZE = (160, 120)


def warm_up(part: str, report: Callable[[str], None] = lambda _: None) -> None:
    """Compile one of PARTS.  report: is told what goes on."""
    report(f"compiling: {part}")
    parts = {
        "tracking": _tracking, "silhouettes": _silhouettes, "actor": _actor, "tracker": _tracker, "recognizer": _recognizer,
        "pictures": _pictures,
    }  # fmt: skip
    parts[part](report)


def _actor(_: Callable[[str], None]) -> None:
    somebody = person(0)
    film = ActorCamera(_cameras()[0], somebody, 0)
    film.render(stretched(somebody), 0)
    film.render(None, 1)


def _silhouettes(_: Callable[[str], None]) -> None:
    camera, *_others = _cameras()
    pictures = [_drawn(camera, pose, k) for k, pose in enumerate(_poses())]
    background = learn(pictures[:EMPTY])
    seen = extract(background, pictures[-1], SilhouetteOptions())
    update(background, pictures[-1], seen.mask if seen else None)


def _tracking(report: Callable[[str], None]) -> None:
    """The search for limbs, which is most of it; then both steps from the background to lost limbs."""
    load_compiled(viewer_setup("1", _cameras()[0], FirstFrames(EMPTY), True))
    _steps(_rig(), report)


def _tracker(report: Callable[[str], None]) -> None:
    """The tracker, without and with somebody to follow, and what learning a prior takes."""
    spec = tracker_spec(TrackerTable(), "hybrid", True, Path())
    rig = replace(_rig(), method="hybrid", tracker=spec)
    load_compiled_tracker(tracker_service(rig).setup)
    expectation(np.ones((1, 1)), np.zeros((2, 1)))
    _steps(rig, report)


def _recognizer(_: Callable[[str], None]) -> None:
    """One posture that is nothing in particular."""
    load_compiled_recognizer(plan_of(stand_in()), TEN_PARTS)


def _pictures(_: Callable[[str], None]) -> None:
    load_compiled_pictures(true_bdp(person(0)))


def _rig() -> Rig:
    viewers = tuple(
        Viewer(str(k + 1), camera, SIZE, VideoFile(Path("none")), FirstFrames(EMPTY), FPS, False, True)
        for k, camera in enumerate(_cameras())
    )
    return Rig("warmup", "two-view", viewers, (), Path(), "", ZenohTable(), LogTable(), ())


def _steps(rig: Rig, report: Callable[[str], None]) -> None:
    """The services of a rig, over pictures."""
    clock = ManualClock(EPOCH_NS)
    offline = Offline(rig, LocalNetwork(rig.name, clock))
    for k, pose in enumerate(_poses()):
        captured_ns = EPOCH_NS + round(k * 1e9 / FPS)
        clock.set(captured_ns)
        images = {viewer.id: _drawn(viewer.camera, pose, k) for viewer in rig.viewers}
        offline.see({id: Frame(k, captured_ns, image) for id, image in images.items()})
        report(", ".join(f"{name}: {state}" for name, state in offline.states().items()))


def _cameras() -> tuple[Camera, Camera]:
    """The paper's rig: 5.2 m from the origin, on +Z and on -X, 1 m above the ground.  [Two-view 4.1]"""
    matrix = np.array([[150.0, 0.0, 79.5], [0.0, 150.0, 59.5], [0.0, 0.0, 1.0]])
    front = np.diag([1.0, -1.0, -1.0])
    side = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    away = np.array([0.0, 1.0, 5.2])
    one, two = (Camera(name, SIZE, matrix, np.zeros(4), rotation, away) for name, rotation in (("1", front), ("2", side)))
    return one, two


def _poses() -> Iterator[Pose | None]:
    """Nobody, then the initial posture, then the arms go down, and at last are lost: they jump to the front and up."""
    index = TEN_PARTS.index
    for k in range(EMPTY + STILL + MOVING + AWAY):
        if k < EMPTY:
            yield None
            continue
        pose = _standing(max(0, k - EMPTY - STILL) * np.radians(8))
        if k >= EMPTY + STILL + MOVING:
            pose.angles[index["right_shoulder.z"]] = 0.1
            pose.angles[index["left_shoulder.x"]] = pose.angles[index["left_hip.x"]] = np.radians(70)
        yield pose


def _standing(lowered: float) -> Pose:
    """The initial posture, arms lowered by an angle in radians."""
    pose = neutral_pose(TEN_PARTS, np.array([0.0, 0.95, 0.0]))
    pose.angles[TEN_PARTS.index["right_shoulder.z"]] = np.pi / 2 + lowered
    pose.angles[TEN_PARTS.index["left_shoulder.z"]] = 3 * np.pi / 2 - lowered
    return pose


def _drawn(camera: Camera, pose: Pose | None, seed: int) -> Image:
    """The model in dark before a bright wall, with noise."""
    noise = np.random.default_rng(seed).integers(0, 5, (SIZE[1], SIZE[0], 3))
    image = (150 + noise).astype(np.uint8)
    if pose is not None:
        bdp = true_bdp(person(0))
        for frame, size in zip(part_frames(TEN_PARTS, bdp, pose), bdp.sizes, strict=True):
            hull = cv2.convexHull(np.round(camera.project(end_ellipses(frame, size))).astype(np.int32))
            cv2.fillConvexPoly(image, hull, (40, 50, 60))
    return image
