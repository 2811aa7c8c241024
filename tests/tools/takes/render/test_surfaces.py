"""Body surfaces: closed, smooth, of the size of the body, and moved with their parts."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings

from tests.support.virtual_actors import BODIES, PLACES, SHARES
from tests.support.virtual_actors import posed as actor_posed
from zenocap.common.arrays import Floats
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.tools.takes.render import surfaces

CLOSE_M = 1e-9


@pytest.mark.parametrize("name", BODIES)
def test_every_surface_except_the_visor_is_closed_with_outward_normals(name: str) -> None:
    one = surfaces.body_surface(*BODIES[name])
    surface = one.surface
    triangles = surface.triangles[surface.shades[surface.triangles[:, 0]] != surfaces.VISOR]
    edges = Counter((int(a), int(b)) for t in triangles for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0])))
    assert set(edges.values()) == {1}
    assert all(edges[b, a] == 1 for a, b in edges)  # every edge once in either direction
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0, atol=1e-9)
    corners = surface.points[triangles]
    volume = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert 0.03 < volume < 0.15  # cubic metres; negative if the faces were oriented inwards


@pytest.mark.parametrize("name", BODIES)
def test_limbs_have_the_radii_and_lengths_of_the_body(name: str) -> None:
    anatomy, body = BODIES[name]
    one = surfaces.body_surface(anatomy, body)
    for k, part in enumerate(anatomy.parts):
        points = one.surface.points[one.parts == k]
        if not part.startswith(("left", "right")) or (body.bases is not None and body.bases[k].any()):
            continue
        tip = body.sizes[k, 1:] if body.tips is None else body.tips[k]
        widest = max(body.sizes[k, 1], tip[0])
        np.testing.assert_allclose(np.abs(points[:, 0]).max(), widest, atol=1e-3)
        last = part not in {joint.parent for joint in anatomy.joints}
        reach = body.sizes[k, 0] + (0.0 if last else tip.mean())  # round the next joint, or the end of the limb itself
        np.testing.assert_allclose(points[:, 1].max(), reach, atol=2e-3)


@pytest.mark.parametrize("name", BODIES)
def test_a_body_surface_has_the_height_of_its_person(name: str) -> None:
    anatomy, body = BODIES[name]
    frames = part_frames(anatomy, body, Pose(np.zeros(3), anatomy.neutral))
    assert 1.70 < np.ptp(surfaces.posed_surface(surfaces.body_surface(anatomy, body), frames).points[:, 1]) < 1.82


@pytest.mark.nightly
@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, position=PLACES)
@settings(deadline=None, max_examples=20)
def test_posing_moves_every_part_rigidly(name: str, shares: Floats, position: Floats) -> None:
    actor = actor_posed(name, shares, position)
    frames = part_frames(actor.anatomy, actor.body, actor.pose)
    one = surfaces.body_surface(actor.anatomy, actor.body)
    surface = surfaces.posed_surface(one, frames)
    for k in range(len(actor.anatomy.parts)):
        rows = one.parts == k
        np.testing.assert_allclose(
            (surface.points[rows] - frames[k, :, 3]) @ frames[k, :, :3], one.surface.points[rows], atol=CLOSE_M
        )
        np.testing.assert_allclose(surface.normals[rows] @ frames[k, :, :3], one.surface.normals[rows], atol=CLOSE_M)


def test_left_right_and_lost_parts_have_their_shades() -> None:
    anatomy, body = BODIES["ten-parts"]
    one = surfaces.body_surface(anatomy, body)
    frames = part_frames(*BODIES["ten-parts"], actor_posed("ten-parts", np.full(25, 0.5), np.zeros(3)).pose)
    arm = anatomy.index["left_lower_arm"]
    assert set(one.surface.shades[one.parts == arm]) == {surfaces.LEFT}
    assert set(one.surface.shades[one.parts == anatomy.index["right_upper_leg"]]) == {surfaces.RIGHT}
    assert set(one.surface.shades[one.parts == anatomy.index["head"]]) == {surfaces.HEAD, surfaces.VISOR}
    lost = surfaces.posed_surface(one, frames, {arm})
    assert set(lost.shades[one.parts == arm]) == {surfaces.LOST}
    assert surfaces.LOST not in lost.shades[one.parts != arm]
