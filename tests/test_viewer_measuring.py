"""What a viewer measures of a silhouette.  [Two-view 2.4]"""

import numpy as np
import pytest
from actor_cameras import paper_cameras
from two_view_scene import rows

from common.actor.person import person
from common.actor.pose import neutral
from common.actor.render import ActorCamera
from common.actor.script import stretched
from common.actor.truth import truth
from common.body.anatomy import TEN_PARTS
from services.viewer.body_definition import Scale, front_lengths
from services.viewer.measuring import FINE_STEPS, FINE_TUNED, fine_tuned, looks_like_front, looks_like_side, outline

SIZE = (160, 120)
SOMEBODY = person(3)
HIPS = truth(SOMEBODY, stretched(SOMEBODY)).joints["Hip"]


def silhouette(viewer: int, *, arms_down: bool = False) -> np.ndarray:
    pose = neutral(SOMEBODY) if arms_down else stretched(SOMEBODY)
    return (ActorCamera(paper_cameras(SIZE)[viewer], SOMEBODY, 0).silhouette(pose) > 0).astype(np.uint8)


def test_an_outline_is_where_the_silhouette_stands() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[10:50, 30:40] = 1
    mask[20:24, 20:50] = 1
    shape = outline(mask)
    assert (shape.top, shape.bottom, shape.height, shape.width) == (10, 49, 40, 30)
    assert shape.column == 34.5
    assert shape.top < shape.navel_row < shape.bottom


def test_an_empty_mask_has_no_outline() -> None:
    with pytest.raises(ValueError, match="no person"):
        outline(np.zeros((5, 5), np.uint8))


def test_stretched_arms_look_like_the_front_and_nothing_else_does() -> None:
    assert looks_like_front(outline(silhouette(0)))
    assert not looks_like_front(outline(silhouette(0, arms_down=True)))
    assert not looks_like_front(outline(silhouette(1)))
    assert looks_like_side(outline(silhouette(1)))
    assert not looks_like_side(outline(silhouette(0)))


def test_fine_tuning_keeps_within_its_bounds_and_touches_its_own_lengths_only() -> None:
    mask, camera = silhouette(0), rows(0)
    depth = float(camera[2] @ HIPS + camera[3, 2])
    measured = front_lengths(mask, Scale(depth, float(camera[4, 0]), float(camera[4, 2])))
    tuned = fine_tuned(TEN_PARTS, mask, camera, HIPS, np.eye(3))
    assert set(tuned) == set(measured)
    for name, length in tuned.items():
        if name in FINE_TUNED:
            assert min(FINE_STEPS) - 1e-9 <= length / measured[name] <= max(FINE_STEPS) + 1e-9
        else:
            assert length == measured[name]


def test_fine_tuning_refuses_another_posture() -> None:
    with pytest.raises(ValueError, match="arm"):
        fine_tuned(TEN_PARTS, silhouette(0, arms_down=True), rows(0), HIPS, np.eye(3))
