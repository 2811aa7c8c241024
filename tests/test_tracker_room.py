"""The room that silhouettes leave: distances outside of them, and the way back."""

import numpy as np
import pytest

from common.body.anatomy import FOURTEEN_PARTS
from common.camera.pinhole import Camera
from services.tracker.hull import outlines
from services.tracker.model import model_of
from services.tracker.refine import Weights, misfit_of, refine
from services.tracker.room import Room, no_room, outside_at, room_of
from services.tracker.stature import average_body
from tests.tracker_scenes import upright

FOCAL, AWAY, RADIUS_PX = 600.0, 4.0, 60
MATRIX = np.array([[FOCAL, 0.0, 319.5], [0.0, FOCAL, 239.5], [0.0, 0.0, 1.0]])
CAMERA = Camera("1", (640, 480), MATRIX, np.zeros(4), np.diag([1.0, -1.0, -1.0]), np.array([0.0, 1.0, AWAY]))
MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
NO_RAYS = np.zeros((11, 0), np.float32)


def room_of_disc() -> Room:
    """One view, on +Z, of a disc around the place (0, 1, 0)."""
    row, column = np.mgrid[:480, :640]
    disc = ((column - 319.5) ** 2 + (row - 239.5) ** 2 < RADIUS_PX**2).astype(np.uint8)
    return room_of(outlines([disc], [CAMERA], 100)[1])


@pytest.mark.parametrize("turn", np.linspace(0.0, 6.0, 7))
@pytest.mark.parametrize("beyond_m", [0.05, 0.1, 0.5, 1.2])  # the last two are off the map
def test_a_place_outside_is_as_far_from_the_silhouette_as_it_looks(turn: float, beyond_m: float) -> None:
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    place = np.array([0.0, 1.0, 0.0]) + (RADIUS_PX * AWAY / FOCAL + beyond_m) * across
    found = np.zeros(4)
    assert outside_at(room_of_disc(), 0, *place, found)
    assert found[0] == pytest.approx(beyond_m, abs=0.04 + 0.05 * beyond_m)  # a coarse map, dilated by a pixel
    ray = (place - CAMERA.centre) / np.linalg.norm(place - CAMERA.centre)
    inward = -across + (across @ ray) * ray  # and along the ray nothing changes
    assert found[1:] @ inward > 0.9 * np.linalg.norm(inward)  # of a coarse disc
    assert np.linalg.norm(found[1:]) == pytest.approx(1.0)


def test_inside_behind_the_camera_and_out_of_the_picture_nothing_is_outside() -> None:
    room, found = room_of_disc(), np.zeros(4)
    for place in ((0.0, 1.0, 0.0), (0.2, 1.1, 0.0), (0.0, 1.0, AWAY + 1.0), (3.0, 1.0, 0.0)):
        assert not outside_at(room, 0, *place, found)


def test_a_body_outside_is_misfitting_and_pulled_towards_the_silhouette() -> None:
    """Without a single ray: only the room can do that."""
    pose = upright()
    pose.position[0] = 1.0
    weights = Weights(0.01, 3.0, np.full(6 + len(MODEL.low), 1.0), 0.25)
    before = misfit_of(MODEL, NO_RAYS, room_of_disc(), 3.0, pose.position, pose.rotation, pose.values)
    assert before > 0.05
    assert misfit_of(MODEL, NO_RAYS, no_room(), 3.0, pose.position, pose.rotation, pose.values) == 0.0
    target = pose.copy()
    refine(
        MODEL, NO_RAYS, room_of_disc(), weights, 10, pose.position, pose.rotation, pose.values,
        target.position, target.rotation, target.values,
    )  # fmt: skip
    after = misfit_of(MODEL, NO_RAYS, room_of_disc(), 3.0, pose.position, pose.rotation, pose.values)
    assert after < 0.8 * before
