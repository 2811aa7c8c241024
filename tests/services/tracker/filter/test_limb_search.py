"""Search of a limb without rays: placements, support, replaced particle."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import DOF, MODEL, rays_alone, tangent_rays, turn, upright
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import misfit
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.limb_search import UsualSupport, limb_support, limbs_of, search_limbs
from zenocap.services.tracker.filter.particles import Cloud, RefinementScene
from zenocap.services.tracker.parameters import LIMB_MAX_SWING

NAMES = coordinates_of(FOURTEEN_PARTS).names
WEIGHTS = Weights(0.01, 0.15, np.full(DOF, 1.0 / 0.4**2), 0.25)
USUAL = np.array([0.08, 0.08, 0.12, 0.12])


LOST = upright(seed=1, spread=0.0)
RAISED = LOST.copy()  # the same with the right arm raised sideways
RAISED.values[NAMES.index("right_shoulder.3")] -= 1.3


def searched(true: RootedPose, tracked: RootedPose, *, misfits: bool = False, support: float = 0.9) -> tuple[Cloud, Cloud]:
    """Particles before and after a search, all at one pose but the last, which is the worst."""
    n = 5
    values = np.array([tracked.values] * (n - 1) + [tracked.values + 0.4])
    before = Cloud(
        np.tile(tracked.position, (n, 1)), np.tile(tracked.rotation, (n, 1, 1)), values, np.zeros(n, int), np.full(n, 0.2)
    )
    after = Cloud(*(array.copy() for array in before))
    scene = RefinementScene(MODEL, rays_alone(tangent_rays(MODEL, true, 500)), WEIGHTS)
    poses = [RootedPose(before.positions[k], before.rotations[k], before.values[k]) for k in range(n)]
    errors = np.array([misfit(MODEL, scene.evidence, 0.15, pose) for pose in poses])
    search_limbs(FOURTEEN_PARTS, scene, 4, UsualSupport(USUAL, support, misfits), after, errors, np.random.default_rng(1))
    return before, after


@each_anatomy
def test_four_limbs_with_placements_within_reach(anatomy: Anatomy) -> None:
    limbs = limbs_of(anatomy)
    assert [anatomy.parts[limb.parts[0]] for limb in limbs] == [
        "right_upper_arm", "left_upper_arm", "right_upper_leg", "left_upper_leg"
    ]  # fmt: skip
    for limb, most in zip(limbs, [LIMB_MAX_SWING["shoulder"]] * 2 + [LIMB_MAX_SWING["hip"]] * 2, strict=True):
        assert len(limb.placements) >= 100
        for vector in limb.placements[:, :3]:
            assert np.arccos(np.clip(turn(vector)[1, 1], -1.0, 1.0)) <= most + 1e-6  # of the part's axis


@pytest.mark.slow
def test_a_limb_that_is_elsewhere_loses_its_support() -> None:
    scene = rays_alone(tangent_rays(MODEL, RAISED, 500))
    there, gone = (limb_support(FOURTEEN_PARTS, MODEL, scene, pose) for pose in (RAISED, LOST))
    assert there.min() > 0.03
    assert gone[0] < 0.5 * there[0]
    assert gone[2:] == pytest.approx(there[2:], abs=0.02)


@pytest.mark.nightly
def test_a_lost_arm_is_found_and_replaces_the_worst_particle() -> None:
    before, after = searched(RAISED, LOST)
    assert np.array_equal(after.values[:4], before.values[:4])
    arm = [k for k, name in enumerate(NAMES) if name.startswith("right_shoulder")]
    assert after.values[4, arm] == pytest.approx(RAISED.values[arm], abs=0.35)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("tracked", "misfits", "support"),
    [(LOST, True, 0.9), (LOST, False, 9.0), (RAISED, False, 0.9)],
    ids=["lost body", "little of the scene", "every limb supported"],
)
def test_no_limb_is_searched_while_the_body_does_not_fit_or_every_limb_does(
    tracked: RootedPose, misfits: bool, support: float
) -> None:
    before, after = searched(RAISED, tracked, misfits=misfits, support=support)
    assert np.array_equal(after.values, before.values)
