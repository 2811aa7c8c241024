"""Pictures: limbs are where kinematics and camera put them, shadows where the sun is blocked."""

import numpy as np
import pytest

from tests.support.virtual_actors import BODIES, stretched
from zenocap.common.arrays import Floats, Image
from zenocap.common.body.kinematics import part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.takes.render import surfaces
from zenocap.tools.takes.render.camera_path import VIEWS, framing_camera
from zenocap.tools.takes.render.caption import Caption, write
from zenocap.tools.takes.render.scene import Ground, Scene, sun_of
from zenocap.tools.takes.render.theme import THEMES

SIZE = (320, 240)
GROUND = Ground(np.zeros(2), 4.0)


def surface_of(name: str) -> surfaces.Surface:
    actor = stretched(name)
    return surfaces.posed_surface(surfaces.body_surface(*BODIES[name]), part_frames(actor.anatomy, actor.body, actor.pose))


def scene(name: str, look: str = "light", view: str = "front") -> tuple[Camera, Scene, surfaces.Surface]:
    surface = surface_of(name)
    azimuth, elevation = np.radians(VIEWS[view])
    camera = framing_camera(
        float(azimuth), float(elevation), np.concatenate([surface.points, surface.points * [1, 0, 1]]), SIZE
    )
    return camera, Scene(camera, GROUND, THEMES[look], sun_of(float(azimuth)), 2), surface


def at(image: Image, camera: Camera, point: Floats) -> tuple[int, int, int]:
    """Blue, green, red at the image of a world point."""
    column, row = np.rint(camera.project(point[None])[0]).astype(int)
    blue, green, red = image[row, column].tolist()
    return blue, green, red


@pytest.mark.parametrize("look", THEMES)
@pytest.mark.parametrize("name", BODIES)
def test_forearms_are_where_the_kinematics_put_them_left_orange_right_blue(name: str, look: str) -> None:
    camera, stage, _ = scene(name, look)
    actor = stretched(name)
    image = stage.picture(surface_of(name))
    frames = part_frames(actor.anatomy, actor.body, actor.pose)
    for side in ("left", "right"):
        k = actor.anatomy.index[f"{side}_lower_arm"]
        middle = frames[k, :, 3] + 0.5 * actor.body.sizes[k, 0] * frames[k, :, 1]
        blue, _, red = at(image, camera, middle)
        assert (red > blue + 40) if side == "left" else (blue > red + 40), side


@pytest.mark.parametrize("look", THEMES)
def test_pixels_without_body_or_shadow_are_unchanged(look: str) -> None:
    camera, stage, surface = scene("ten-parts", look)
    empty, image = stage.picture(None), stage.picture(surface)
    changed = (empty != image).any(axis=2)
    pixels = camera.project(surface.points)
    sun = sun_of(0.0)
    shadow = surface.points - surface.points[:, 1:2] / sun[1] * sun
    both = np.concatenate([pixels, camera.project(shadow), camera.project(surface.points * [1, 0, 1])])
    low, high = both.min(axis=0) - 40, both.max(axis=0) + 40  # the soft edges
    found = np.argwhere(changed)[:, ::-1]
    assert len(found) > 1000
    assert ((found >= low) & (found <= high)).all()
    np.testing.assert_array_equal(stage.picture(None), empty)  # drawing does not change the scene


def test_the_floor_is_darker_where_the_body_blocks_the_sun() -> None:
    camera, stage, surface = scene("fourteen-parts", "light", "quarter")
    sun = sun_of(float(np.radians(VIEWS["quarter"][0])))
    empty, image = stage.picture(None).astype(int), stage.picture(surface).astype(int)
    hips = surface.points[np.abs(surface.points[:, 1] - 0.9) < 0.05].mean(axis=0)
    below = hips - hips[1] / sun[1] * sun
    assert at(image, camera, below)[0] < at(empty, camera, below)[0] - 20
    elsewhere = below + np.array([-1.6, 0.0, 0.3])
    assert at(image, camera, elsewhere) == at(empty, camera, elsewhere)


def test_a_nearer_limb_hides_a_farther_one() -> None:
    camera, stage, surface = scene("ten-parts", "light", "right")  # the right arm points at the camera
    image = stage.picture(surface)
    hand = surface.points[:, 0].min()
    blue, _, red = at(image, camera, np.array([hand + 0.05, 1.0 + BODIES["ten-parts"][1].sizes[0, 0], 0.0]))
    assert blue > red + 40


def test_a_body_outside_the_picture_leaves_the_empty_floor() -> None:
    _, stage, surface = scene("ten-parts")
    for away in ([0.0, 0.0, 50.0], [60.0, 0.0, 0.0]):
        gone = surfaces.Surface(surface.points + away, surface.normals, surface.triangles, surface.shades)
        np.testing.assert_array_equal(stage.picture(gone), stage.picture(None))


def test_trails_lie_on_their_paths_and_end_at_the_last_position() -> None:
    path = np.stack([np.linspace(0, 1, 50), np.sin(np.linspace(0, 3, 50)), np.zeros(50)], axis=1)
    path[10:12] = np.nan
    found = surfaces.trails({"LWrist": path, "RWrist": np.full((50, 3), np.nan)})
    assert found is not None
    away = np.linalg.norm(found.points[:, None] - path[None], axis=2)
    assert np.nanmin(away, axis=1).max() < surfaces.TRAIL_RADIUS_M + 0.1  # straight across the gap
    assert np.nanmin(away[:, -1]) <= surfaces.TRAIL_RADIUS_M + 1e-9
    assert found.triangles.max() < len(found.points)


def test_a_still_or_unknown_joint_has_no_trail() -> None:
    still = np.zeros((30, 3)) + 0.1 * surfaces.TRAIL_SPACING_M * np.random.default_rng(0).random((30, 3))
    assert surfaces.trails({"LWrist": still, "RAnkle": np.full((5, 3), np.nan)}) is None


@pytest.mark.parametrize("size", [(64, 64), (320, 240), (1920, 1080)])
def test_captions_are_drawn_at_every_size_and_with_all_letters(size: tuple[int, int]) -> None:
    image = np.full((size[1], size[0], 3), 200, dtype=np.uint8)
    write(image, Caption("walk äöü 走 " * 9, "12.34 s", "kick-right", progress=0.5), THEMES["light"])
    assert (image != 200).any()
    bar = image[-1].astype(int)
    assert bar[0, 0] != bar[-1, 0]  # half of the bar is full


def test_a_warning_replaces_the_label() -> None:
    def written(caption: Caption) -> Image:
        image = np.full((240, 320, 3), 200, dtype=np.uint8)
        write(image, caption, THEMES["dark"])
        return image

    lost = written(Caption("walk", "", "wave", warning="person lost"))
    np.testing.assert_array_equal(lost, written(Caption("walk", "", "", warning="person lost")))
    assert (lost != written(Caption("walk", "", "wave"))).any()
