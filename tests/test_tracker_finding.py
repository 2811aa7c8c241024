"""A known body is found in everyday postures, facing anywhere, and turned round when it faces the wrong way."""

from functools import lru_cache

import numpy as np
import pytest
from tracker_ring import initial, ring, scene, seen, setup, someone

from common.actor.pose import ActorPose, Placement, neutral, place
from common.actor.script import motion_script
from common.actor.truth import truth
from common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, Anatomy
from services.tracker.closest import Singles
from services.tracker.filtering import HOLD, weights_of
from services.tracker.finding import everyday, explained, found_in, misfit, turned_round
from services.tracker.initial import Start, Stretched, measured_from, stretched_in
from services.tracker.model import Model, model_of
from services.tracker.posed import Posed
from services.tracker.room import Room

CAMERAS = ring(4)
SEED = 2
WEIGHTS = weights_of(setup(CAMERAS), HOLD)
ROUNDS = 4


@lru_cache
def model() -> Model:
    rays, room = shown(initial(SEED))
    one = stretched_in(rays)
    assert isinstance(one, Stretched)
    start = measured_from(FOURTEEN_PARTS, [rays], [room], [one])
    assert isinstance(start, Start)
    return model_of(FOURTEEN_PARTS, start.measured.body)


def shown(pose: ActorPose | None) -> tuple[Singles, Room]:
    return scene(CAMERAS, list(seen(CAMERAS, SEED, pose).values()))


def find(rays: Singles, room: Room, facing: Posed | None = None) -> Posed | None:
    preferred = None if facing is None else facing.rotation
    height = someone(SEED).height
    return found_in(model(), rays, room, everyday(FOURTEEN_PARTS), height, WEIGHTS, ROUNDS, preferred)


def forward(yaw: float) -> np.ndarray:
    return np.array([np.sin(yaw), 0.0, np.cos(yaw)])


@pytest.mark.parametrize("yaw", np.linspace(0.0, 2 * np.pi, 5)[:-1] + 0.3)
def test_somebody_at_ease_is_found_facing_anywhere(yaw: float) -> None:
    pose = place(neutral(someone(SEED)), Placement(0.4, 0.3, yaw))
    found = find(*shown(pose))
    assert found is not None
    assert np.linalg.norm(found.position - truth(someone(SEED), pose).joints["Hip"]) < 0.08
    assert found.rotation[:, 2] @ forward(yaw) > 0.9


@pytest.mark.parametrize("name", ["walking", "running", "boxing"])
def test_somebody_in_motion_is_found(name: str) -> None:
    script = motion_script(someone(SEED), name, 0)
    for later_s in (0.5, 1.1):
        pose = script.pose_at(script.motion_from_s + later_s)
        assert pose is not None
        rays, room = shown(pose)
        found = find(rays, room)
        assert found is not None
        assert np.linalg.norm(found.position - truth(someone(SEED), pose).joints["Hip"]) < 0.12
        assert explained(model(), rays, found) > 0.5


def test_nobody_is_not_found() -> None:
    assert find(*shown(None)) is None


def test_the_preferred_facing_wins_unless_it_fits_worse() -> None:
    pose = place(neutral(someone(SEED)), Placement(0.0, 0.0, 0.3))
    rays, room = shown(pose)
    free = find(rays, room)
    assert free is not None
    with_it, against_it = find(rays, room, free), find(rays, room, Posed(free.position, -free.rotation, free.values))
    assert with_it is not None
    assert against_it is not None
    np.testing.assert_array_equal(with_it.rotation, free.rotation)
    assert misfit(model(), rays, room, against_it, WEIGHTS) <= 1.3 * misfit(model(), rays, room, free, WEIGHTS)


def test_who_faces_the_wrong_way_fits_worse_than_turned_round() -> None:
    script = motion_script(someone(SEED), "walking", 0)
    pose = script.pose_at(script.motion_from_s + 0.5)
    assert pose is not None
    rays, room = shown(pose)
    right = find(rays, room)
    assert right is not None
    wrong = turned_round(model(), rays, room, right, everyday(FOURTEEN_PARTS), WEIGHTS, ROUNDS)
    again = turned_round(model(), rays, room, wrong, everyday(FOURTEEN_PARTS), WEIGHTS, ROUNDS)
    assert wrong.rotation[:, 2] @ right.rotation[:, 2] < 0.0
    assert misfit(model(), rays, room, right, WEIGHTS) < misfit(model(), rays, room, wrong, WEIGHTS)
    assert again.rotation[:, 2] @ right.rotation[:, 2] > 0.8


@pytest.mark.parametrize("anatomy", ANATOMIES.values(), ids=ANATOMIES)
def test_everyday_postures_are_different_ones_of_every_anatomy(anatomy: Anatomy) -> None:
    postures = everyday(anatomy)
    assert len(postures) == 5
    assert len({posture.values.tobytes() for posture in postures}) == 5
