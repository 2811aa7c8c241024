"""The universal BAP from partial ones.  [Two-view 4.4]"""

import numpy as np
import pytest
from msgspec.structs import replace

from tests.support.perfect_viewers import FIRST, TRACKED, partial_bap, play, sighting
from tests.support.two_view_run import VIEWERS
from tests.support.two_view_scene import angles, degrees_between
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import LIMBS, hanging_arm, limb_directions
from zenocap.services.integrator.parameters import EXCHANGE_AT
from zenocap.services.integrator.states import IntegratorState

INDEX = TEN_PARTS.index


def pose(state: IntegratorState, frame: int, *baps: m.PartialBap) -> tuple[IntegratorState, m.UniversalBap]:
    state, _ = play(state, *(sighting(v, frame) for v in VIEWERS))
    state, (bap,) = play(state, *baps)
    return state, bap


def directions_of(bap: m.UniversalBap) -> Floats:
    return limb_directions(TEN_PARTS, np.array([bap.angles[name] for name in TEN_PARTS.angles]))


def test_theta_z_comes_from_the_facade_and_theta_x_from_the_flank() -> None:
    facade, flank = angles(right_shoulder_z=130), angles(right_shoulder_z=180, right_shoulder_x=40)
    _, bap = pose(TRACKED, FIRST, partial_bap("1", FIRST, facade), partial_bap("2", FIRST, flank))
    upper = directions_of(bap)[0, 0]
    assert upper[0] < -0.4
    assert upper[2] > 0.4


def test_a_hidden_arm_is_moved_towards_the_rest_pose() -> None:
    raised = angles(left_shoulder_z=270)
    unseen = {limb: m.LimbMatch(score=0.9, visible=float(n != 1), matchings=[7]) for n, limb in enumerate(LIMBS)}
    shown = [partial_bap(v, FIRST, raised) for v in VIEWERS]
    hidden = [replace(bap, limbs=unseen) for bap in shown]
    rest = hanging_arm(np.eye(3), 0.0)[0]
    away = [degrees_between(directions_of(pose(TRACKED, FIRST, *baps)[1])[1, 0], rest) for baps in (hidden, shown)]
    assert away[0] < away[1]


def test_the_universal_bap_has_all_angles_and_keeps_those_missing_in_partial_ones() -> None:
    only_arm = {name: angle for name, angle in partial_bap("1", FIRST, angles()).angles.items() if "right_shoulder" in name}
    _, bap = pose(TRACKED, FIRST, *(replace(partial_bap(v, FIRST, angles()), angles=only_arm) for v in VIEWERS))
    assert set(bap.angles) == set(TEN_PARTS.angles)
    assert degrees_between(directions_of(bap)[0, 0], np.array([0.0, -1.0, 0.0])) < 5
    assert bap.angles["left_shoulder.z"] == pytest.approx(3 * np.pi / 2, abs=0.15)  # still stretched


STEP = angles(right_hip_x=30, left_hip_x=-20)


def test_lasting_evidence_of_the_facade_exchanges_the_legs() -> None:
    state, frame, found = TRACKED, FIRST, None
    for frame in range(FIRST, FIRST + 12):
        baps = (replace(partial_bap("1", frame, STEP), exchange=EXCHANGE_AT / 3), partial_bap("2", frame, STEP))
        state, bap = pose(state, frame, *baps)
        found = directions_of(bap)
        if found[2, 0, 2] < 0:
            break
    assert FIRST < frame < FIRST + 11, "exchanged, but not at once"
    assert np.max(degrees_between(found[2:, 0], limb_directions(TEN_PARTS, STEP)[[3, 2], 0])) < 10


def test_evidence_of_the_flank_does_not_exchange_the_legs() -> None:
    state = TRACKED
    for frame in range(FIRST, FIRST + 12):
        state, bap = pose(state, frame, partial_bap("1", frame, STEP), replace(partial_bap("2", frame, STEP), exchange=0.5))
        assert directions_of(bap)[2, 0, 2] > 0


def test_the_bap_of_a_single_viewer_has_the_directions_it_observed() -> None:
    lifted = angles(right_hip_x=40, right_knee_x=-50)
    state, _ = play(TRACKED, *(sighting(v, f) for f in (FIRST, FIRST + 1) for v in VIEWERS))
    _, (bap, *_) = play(state, partial_bap("2", FIRST, lifted), partial_bap("2", FIRST + 1, lifted))
    assert (bap.stale, set(bap.scores)) == (["1"], {"2"})
    assert np.max(degrees_between(directions_of(bap)[2], limb_directions(TEN_PARTS, lifted)[2])) < 5
