"""The initial posture: seen in clean and cluttered scenes, refused in others, measured with the right side in front."""

import numpy as np
import pytest
from tracker_ring import Mask, initial, ring, scene, seen, someone

from common.actor.pose import ActorPose, Placement, neutral, place
from common.actor.truth import truth
from common.body.anatomy import FOURTEEN_PARTS
from services.tracker.closest import FAR, NEAR, Singles
from services.tracker.initial import Start, Stretched, measured_from, stretched_in

YAWS = (0.1, 1.2, 2.9)


def rays_of(seed: int, pose: ActorPose | None, views: int = 4) -> Singles:
    cameras = ring(views)
    rays, _ = scene(cameras, list(seen(cameras, seed, pose).values()))
    return rays


@pytest.mark.parametrize("seed", [1, 2, 5])
@pytest.mark.parametrize("yaw", YAWS)
def test_it_is_seen_wherever_somebody_faces(seed: int, yaw: float) -> None:
    found = stretched_in(rays_of(seed, initial(seed, 0.3, -0.2, yaw)))
    assert isinstance(found, Stretched)
    assert np.linalg.norm(found.centre - [0.3, -0.2]) < 0.1
    assert abs(float(found.across @ [np.cos(yaw), -np.sin(yaw)])) > np.cos(np.radians(10.0))
    assert found.stature == pytest.approx(someone(seed).height, rel=0.08)


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (None, "waiting for a person"),
        (neutral(someone(1)), "stretch both arms sideways"),
    ],
)
def test_what_is_missing_is_said(pose: ActorPose | None, words: str) -> None:
    found = stretched_in(rays_of(1, pose))
    assert isinstance(found, str)
    assert found.startswith(words)


def test_something_too_small_is_no_person() -> None:
    rays = rays_of(1, neutral(someone(1)))
    rays[:3] *= 0.3
    rays[NEAR : FAR + 1] *= 0.3
    found = stretched_in(rays)
    assert isinstance(found, str)
    assert "0.8 to 2.4 m is waited for" in found


def cluttered(masks: dict[str, Mask]) -> list[Mask]:
    """Something stands beside and behind the person in every view, and something lies at the feet."""
    spoilt = []
    for k, mask in enumerate(masks.values()):
        spoilt.append(mask.copy())
        height, width = mask.shape
        spoilt[-1][height // 3 : height // 2, (20 + 50 * k) % width : (50 + 50 * k) % width] = 1
        bottom = int(np.flatnonzero(mask.any(axis=1)).max())
        spoilt[-1][bottom - 3 : bottom + 3, width // 4 : 3 * width // 4] = 1
    return spoilt


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_it_is_seen_and_measured_among_clutter(seed: int) -> None:
    cameras = ring(4)
    rays, room = scene(cameras, cluttered(seen(cameras, seed, initial(seed, 0.3, -0.2, 0.3))))
    found = stretched_in(rays)
    assert isinstance(found, Stretched)
    assert np.linalg.norm(found.centre - [0.3, -0.2]) < 0.15
    start = measured_from(FOURTEEN_PARTS, [rays], [room], [found])
    assert isinstance(start, Start)
    hip = truth(someone(seed), initial(seed, 0.3, -0.2, 0.3)).joints["Hip"]
    assert np.linalg.norm(start.measured.poses[0].position - hip) < 0.12


@pytest.mark.parametrize("views", [3, 7])
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_front_is_told_from_back(seed: int, views: int) -> None:
    cameras = ring(views)
    for yaw in YAWS:
        rays, room = scene(cameras, list(seen(cameras, seed, initial(seed, yaw=yaw)).values()))
        found = stretched_in(rays)
        assert isinstance(found, Stretched)
        start = measured_from(FOURTEEN_PARTS, [rays], [room], [found])
        assert isinstance(start, Start)
        front = start.measured.poses[0].rotation[:, 2]
        assert float(front @ [np.sin(yaw), 0.0, np.cos(yaw)]) > 0.9, yaw


def test_a_posture_that_is_not_the_initial_one_is_not_measured() -> None:
    cameras = ring(4)
    arms = neutral(someone(1)).arms.copy()
    arms[:, 0], arms[:, 3] = np.radians(90.0), np.radians(90.0)  # elbows bent to the front
    bent = initial(1)
    rays, room = scene(cameras, list(seen(cameras, 1, type(bent)(**{**vars(bent), "arms": arms})).values()))
    found = stretched_in(rays)
    if isinstance(found, Stretched):
        start = measured_from(FOURTEEN_PARTS, [rays], [room], [found])
        assert isinstance(start, str)
        assert "degrees off" in start or "no body fits" in start
    else:
        assert found.startswith("stretch both arms sideways")


def test_somebody_at_the_edge_of_the_room_is_seen() -> None:
    found = stretched_in(rays_of(1, place(initial(1), Placement(1.2, -1.0, 0.4)), views=7))
    assert isinstance(found, Stretched)
    assert np.linalg.norm(found.centre - [1.2, -1.0]) < 0.1
