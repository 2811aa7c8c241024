"""Rendering agrees with the ground truth for every camera, and is deterministic."""

import cv2
import numpy as np
import pytest

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import neutral
from zenocap.simulation.body.skeleton import pose_bones
from zenocap.simulation.body.surface import rest_surface, skin
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.postures import POSTURES, posture
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

pytestmark = pytest.mark.slow

LENS = np.array([-0.12, 0.05, 0.001, -0.001, 0.0])
ANYWHERE = (
    look("level", np.array([0.0, 1.0, 5.2]), np.array([0.0, 1.0, 0.0])),
    look("high", np.array([3.0, 2.9, -3.0]), np.array([0.0, 0.9, 0.0])),
    look("rolled", np.array([-3.5, 1.4, 2.6]), np.array([0.0, 0.9, 0.0]), roll=0.5),
    look("low", np.array([1.0, 0.2, 4.5]), np.array([0.0, 1.1, 0.0]), roll=-0.2),
    look("lens", np.array([2.0, 1.6, 4.0]), np.array([0.0, 0.9, 0.0]), distortions=LENS),
)


@pytest.mark.nightly
@pytest.mark.parametrize("name", POSTURES)
def test_projected_joints_lie_inside_the_silhouette(name: str) -> None:
    for seed, camera in zip((1, 9), paper_cameras((320, 240)), strict=True):
        subject = person(seed)
        renderer = SimulatedCamera(camera, subject, 0)
        pose = posture(subject, name, seed).pose_at(1.3)
        _joints_inside(renderer, renderer.silhouette(pose), truth(subject, pose).joints)


@pytest.mark.nightly
@pytest.mark.parametrize("camera", ANYWHERE, ids=lambda c: c.name)
def test_projected_joints_lie_inside_the_silhouette_of_any_camera(camera: Camera) -> None:
    subject = person(4)
    renderer = SimulatedCamera(camera, subject, 0)
    for pose in (t_pose(subject), posture(subject, "kick-right", 1).pose_at(1.2)):
        _joints_inside(renderer, renderer.silhouette(pose), truth(subject, pose).joints)


def _joints_inside(renderer: SimulatedCamera, mask: np.ndarray, joints: dict[str, np.ndarray]) -> None:
    near = cv2.dilate(mask, np.ones((3, 3), dtype=np.uint8))  # the top of the head lies on the outline
    for name, point in joints.items():
        x, y = np.rint(renderer.camera.project(point[None])[0]).astype(int)
        assert near[y, x] == 255, (renderer.camera.name, name)


@pytest.mark.nightly
@pytest.mark.parametrize("camera", ANYWHERE, ids=lambda c: c.name)
def test_the_silhouette_is_the_projection_of_the_surface(camera: Camera) -> None:
    subject = person(7)
    pose = posture(subject, "squat-arms-forward", 1).pose_at(1.2)
    mask = SimulatedCamera(camera, subject, 0).silhouette(pose)
    surface = rest_surface(subject)
    points, _ = skin(surface, subject, pose_bones(subject, pose))
    pixels = camera.project(points)
    oracle = np.zeros_like(mask)
    for triangle in surface.triangles:
        cv2.fillConvexPoly(oracle, np.rint(pixels[triangle] * 16).astype(np.int32), 255, cv2.LINE_8, 4)
    differs = mask != oracle
    # OpenCV fills every pixel it touches: half a pixel more all round.
    edge = cv2.morphologyEx(oracle, cv2.MORPH_GRADIENT, np.ones((5, 5), dtype=np.uint8)) > 0
    assert np.sum(differs & ~edge) < 1e-3 * np.sum(oracle > 0)  # and closes narrow gaps
    assert 0.88 < mask.sum() / oracle.sum() <= 1.0


@pytest.mark.nightly
def test_frames_are_repeatable_and_differ_by_frame_camera_and_seed() -> None:
    subject = person(2)
    one, two = paper_cameras((160, 120))
    pose = t_pose(subject)
    frame = SimulatedCamera(one, subject, 3).render(pose, 7)
    assert np.array_equal(frame, SimulatedCamera(one, subject, 3).render(pose, 7))
    for other in (
        SimulatedCamera(one, subject, 3).render(pose, 8),
        SimulatedCamera(one, subject, 4).render(pose, 7),
        SimulatedCamera(two, subject, 3).render(pose, 7),
        SimulatedCamera(one, person(8), 3).render(pose, 7),
    ):
        assert not np.array_equal(frame, other)


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(160, 120), (640, 480), (333, 250)])
def test_the_empty_room_is_the_background_and_sensor_noise(size: tuple[int, int]) -> None:
    renderer = SimulatedCamera(paper_cameras(size)[0], person(2), 3)
    background = renderer.background().astype(float)
    frames = [renderer.render(None, k).astype(float) for k in range(12)]
    assert frames[0].shape == (size[1], size[0], 3)
    noise = np.array([f - background for f in frames])
    assert 1.5 < np.std(frames[0] - frames[1]) / 2**0.5 < 3.5
    flicker = noise.mean(axis=(1, 2, 3)) / background.mean()
    assert 0.0005 < np.abs(flicker).max() < 0.01
    assert background.std() > 10.0


@pytest.mark.parametrize("seed", range(6))
def test_people_stand_out_from_the_room(seed: int) -> None:
    subject = person(seed)
    for camera in paper_cameras((160, 120)):
        renderer = SimulatedCamera(camera, subject, seed)
        pose = t_pose(subject)
        inside = renderer.silhouette(pose) > 0
        change = np.abs(renderer.render(pose, 0).astype(float) - renderer.background()).max(axis=2)
        assert np.median(change[inside]) > 25.0
        assert np.mean(change[inside] < 8.0) < 0.2


@pytest.mark.nightly
def test_the_shadow_darkens_the_floor_and_keeps_its_hue() -> None:
    subject = person(7)
    camera = look("above", np.array([1.0, 2.8, 3.5]), np.array([0.0, 0.3, 0.0]))
    renderer = SimulatedCamera(camera, subject, 3)
    pose = neutral(subject)
    outside = cv2.dilate(renderer.silhouette(pose), np.ones((5, 5), dtype=np.uint8)) == 0
    empty = np.mean([renderer.render(None, k) for k in range(24)], axis=0)
    filled = np.mean([renderer.render(pose, k) for k in range(24)], axis=0)
    ratio = filled / empty
    darker = outside & (ratio.mean(axis=2) < 0.93)
    assert darker.sum() > 300
    assert ratio[outside].mean(axis=-1).min() > 0.70
    assert np.abs(ratio[darker] - ratio[darker].mean(axis=1, keepdims=True)).mean() < 0.012
    rows = np.nonzero(darker)[0]
    assert rows.min() > 150  # never on the walls


@pytest.mark.nightly
def test_only_the_visible_part_of_a_person_is_drawn() -> None:
    subject = person(2)
    close = SimulatedCamera(look("close", np.array([0.0, 1.4, 0.9]), np.array([0.0, 1.4, 0.0])), subject, 0)
    away = SimulatedCamera(look("away", np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 9.0])), subject, 0)
    inside = SimulatedCamera(look("inside", np.array([0.0, 1.0, 0.1]), np.array([0.0, 1.0, 9.0])), subject, 0)
    assert 0.1 < np.mean(close.silhouette(t_pose(subject)) > 0) < 0.9
    assert not away.silhouette(t_pose(subject)).any()
    for renderer in (close, away, inside):
        assert renderer.render(t_pose(subject), 0).shape == (480, 640, 3)


def test_silhouette_without_a_person_is_empty() -> None:
    assert not SimulatedCamera(paper_cameras((160, 120))[0], person(1), 0).silhouette(None).any()
