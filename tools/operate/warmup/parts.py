"""Parts of `zenocap warmup`, each for one group of services.

No camera and no file is needed.
"""

import gc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Image
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose, neutral_pose
from zenocap.common.body.kinematics import end_ellipses, part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.file import LogTable, ZenohTable
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.sources import FirstFrames, VideoFile
from zenocap.common.rig.tracker import TrackerTable, tracker_spec
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.compiled import record_compiled
from zenocap.common.session.session import Session
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.model import start
from zenocap.common.vision.background import learn, update
from zenocap.common.vision.extraction import extract
from zenocap.common.vision.prediction import Prediction, depths
from zenocap.common.vision.silhouette import PersonSilhouette, SilhouetteOptions
from zenocap.services.recognizer.jit_warmup import load_compiled as load_compiled_recognizer
from zenocap.services.recognizer.jit_warmup import minimal_model
from zenocap.services.recognizer.stream import stream_setup
from zenocap.services.tracker.jit_warmup import load_compiled as load_compiled_tracker
from zenocap.services.tracker.prior.forward_backward import expectation
from zenocap.services.tracker.shell import tracker_service
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.two_view.jit_warmup import load_compiled
from zenocap.services.viewer.two_view.states import TwoViewSetup
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.members import members
from zenocap.tools.takes.render.camera_path import framing_camera
from zenocap.tools.takes.render.scene import Ground, Scene, sun_of
from zenocap.tools.takes.render.surfaces import body_surface, posed_surface
from zenocap.tools.takes.render.theme import THEMES

EMPTY, STILL, MOVING, AWAY = 4, 14, 6, 4  # frames of the empty scene, the T-pose, lowering the arms, a jump
FPS = 15.0
SIZE = (160, 120)


def warm_up(part: str, report: Callable[[str], None] = lambda _: None) -> None:
    """Run one of PARTS and record that it is compiled.  report: receives one line of progress at a time."""
    gc.disable()  # the compiler makes millions of objects: collecting takes a twentieth of its time
    try:
        PARTS[part](report)
    finally:
        gc.enable()
    record_compiled(part)


def _actor(_: Callable[[str], None]) -> None:
    subject = person(0)
    film = SimulatedCamera(_cameras()[0], subject, 0)
    film.render(t_pose(subject), 0)
    film.render(None, 1)


def _silhouettes(_: Callable[[str], None]) -> None:
    camera, *_others = _cameras()
    pictures = [_drawn(camera, pose, k) for k, pose in enumerate(_poses())]
    background = learn(pictures[:EMPTY])
    seen = extract(background, pictures[-1], SilhouetteOptions())
    update(background, pictures[-1], seen.mask if seen else None)
    model = start(pictures[:EMPTY])
    for number, picture in enumerate(pictures[EMPTY:]):
        model, seen = follow(model, picture, number / FPS, SilhouetteOptions(), prediction=_expected(seen))


def _expected(seen: PersonSilhouette | None) -> Prediction | None:
    """The silhouette itself as the expected image of the body."""
    if seen is None:
        return None
    left, right, top, bottom = seen.extents
    return Prediction(left, top, depths(seen.mask[top : bottom + 1, left : right + 1]), 4.0, seen.extents)


def _tracking(report: Callable[[str], None]) -> None:
    """The limb search, which takes longest to compile; then viewer and integrator from the background to lost limbs."""
    load_compiled(TwoViewSetup("1", _cameras()[0], FirstFrames(EMPTY)))
    _steps(_rig(), report)


def _tracker(report: Callable[[str], None]) -> None:
    """The tracker, without and with a person, and the training of a prior."""
    spec = tracker_spec(TrackerTable(), "hybrid", True, Path())
    rig = replace(_rig(), method="hybrid", tracker=spec)
    load_compiled_tracker(tracker_service(rig).setup)
    expectation(np.ones((1, 1)), np.zeros((2, 1)))
    _steps(rig, report)


def _recognizer(_: Callable[[str], None]) -> None:
    """Recognition of one arbitrary posture."""
    load_compiled_recognizer(stream_setup(minimal_model()), TEN_PARTS)


def _pictures(_: Callable[[str], None]) -> None:
    """Every drawing function, which only `zenocap render` needs: the live page draws in the browser."""
    bdp = true_bdp(person(0))
    surface = posed_surface(body_surface(TEN_PARTS, bdp), part_frames(TEN_PARTS, bdp, _standing(0.0)))
    camera = framing_camera(0.0, 0.1, surface.points, (64, 48))
    Scene(camera, Ground(np.zeros(2), 4.0), next(iter(THEMES.values())), sun_of(0.0)).picture(surface)


def _rig() -> Rig:
    viewers = tuple(
        Viewer(str(k + 1), camera, SIZE, VideoFile(Path("none")), FirstFrames(EMPTY), FPS, False, True)
        for k, camera in enumerate(_cameras())
    )
    return Rig("warmup", "two-view", viewers, (), Path(), "", ZenohTable(), LogTable(), ())


def _steps(rig: Rig, report: Callable[[str], None]) -> None:
    """Run the services of a rig on drawn images."""
    session = Session(rig.name, ManualClock(EPOCH_NS), members(rig), ())
    for k, pose in enumerate(_poses()):
        captured_ns = EPOCH_NS + round(k * 1e9 / FPS)
        images = {viewer.id: _drawn(viewer.camera, pose, k) for viewer in rig.viewers}
        session.frames({id: Frame(k, captured_ns, image) for id, image in images.items()})
        report(", ".join(f"{name}: {state}" for name, state in session.states().items()))


def _cameras() -> tuple[Camera, Camera]:
    """The paper's rig: 5.2 m from the origin, on +Z and on -X, 1 m above the ground.  [Two-view 4.1]"""
    matrix = np.array([[150.0, 0.0, 79.5], [0.0, 150.0, 59.5], [0.0, 0.0, 1.0]])
    front = np.diag([1.0, -1.0, -1.0])
    side = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    away = np.array([0.0, 1.0, 5.2])
    one, two = (Camera(name, SIZE, matrix, np.zeros(4), rotation, away) for name, rotation in (("1", front), ("2", side)))
    return one, two


def _poses() -> Iterator[Pose | None]:
    """The empty scene (None), the T-pose, lowering the arms, then a jump of the arms, which loses the limbs."""
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
    """The T-pose with the arms lowered by an angle, radians."""
    pose = neutral_pose(TEN_PARTS, np.array([0.0, 0.95, 0.0]))
    pose.angles[TEN_PARTS.index["right_shoulder.z"]] = np.pi / 2 + lowered
    pose.angles[TEN_PARTS.index["left_shoulder.z"]] = 3 * np.pi / 2 - lowered
    return pose


def _drawn(camera: Camera, pose: Pose | None, seed: int) -> Image:
    """Image of the dark model in front of a bright wall, with noise; None for the empty scene."""
    noise = np.random.default_rng(seed).integers(0, 5, (SIZE[1], SIZE[0], 3))
    image = (150 + noise).astype(np.uint8)
    if pose is not None:
        bdp = true_bdp(person(0))
        for frame, size in zip(part_frames(TEN_PARTS, bdp, pose), bdp.sizes, strict=True):
            hull = cv2.convexHull(np.round(camera.project(end_ellipses(frame, size))).astype(np.int32))
            cv2.fillConvexPoly(image, hull, (40, 50, 60))
    return image


# By the name in the table of services and in `zenocap warmup --part`.  The services of a running rig draw no pictures.
PARTS: Mapping[str, Callable[[Callable[[str], None]], None]] = {
    "tracking": _tracking, "silhouettes": _silhouettes, "actor": _actor, "tracker": _tracker, "recognizer": _recognizer,
    "pictures": _pictures,
}  # fmt: skip
