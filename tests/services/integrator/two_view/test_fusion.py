"""The universal BAP from partial ones.  [Two-view 4.4]"""

import numpy as np
import pytest

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


def changed(message: m.PartialBap, **fields: object) -> m.PartialBap:
    return m.PartialBap(**{name: getattr(message, name) for name in message.__struct_fields__} | fields)


def pose(state: IntegratorState, frame: int, *baps: m.PartialBap) -> tuple[IntegratorState, m.UniversalBap]:
    state, _ = play(state, *(sighting(v, frame) for v in VIEWERS))
    state, (bap,) = play(state, *baps)
    assert isinstance(bap, m.UniversalBap)
    return state, bap


def directions_of(bap: m.UniversalBap) -> Floats:
    return limb_directions(TEN_PARTS, np.array([bap.angles[name] for name in TEN_PARTS.angles]))


def unseen(k: int) -> dict[str, m.LimbMatch]:
    return {limb: m.LimbMatch(score=0.9, visible=float(n != k), matchings=[7]) for n, limb in enumerate(LIMBS)}


def test_theta_z_comes_from_the_facade_and_theta_x_from_the_flank() -> None:
    facade, flank = angles(right_shoulder_z=130), angles(right_shoulder_z=180, right_shoulder_x=40)
    _, bap = pose(TRACKED, FIRST, partial_bap("1", FIRST, facade), partial_bap("2", FIRST, flank))
    upper = directions_of(bap)[0, 0]
    assert upper[0] < -0.4
    assert upper[2] > 0.4


def test_a_hidden_arm_is_moved_towards_the_rest_pose() -> None:
    raised = angles(left_shoulder_z=270)
    baps = [changed(partial_bap(v, FIRST, raised), limbs=unseen(1)) for v in VIEWERS]
    _, hidden = pose(TRACKED, FIRST, *baps)
    _, shown = pose(TRACKED, FIRST, *(partial_bap(v, FIRST, raised) for v in VIEWERS))
    rest = hanging_arm(np.eye(3), 0.0)[0]
    assert degrees_between(directions_of(hidden)[1, 0], rest) < degrees_between(directions_of(shown)[1, 0], rest)


def test_the_universal_bap_has_all_angles_and_keeps_those_missing_in_partial_ones() -> None:
    only_arm = {name: angle for name, angle in partial_bap("1", FIRST, angles()).angles.items() if "right_shoulder" in name}
    _, bap = pose(TRACKED, FIRST, *(changed(partial_bap(v, FIRST, angles()), angles=only_arm) for v in VIEWERS))
    assert set(bap.angles) == set(TEN_PARTS.angles)
    assert degrees_between(directions_of(bap)[0, 0], np.array([0.0, -1.0, 0.0])) < 5
    assert bap.angles["left_shoulder.z"] == pytest.approx(3 * np.pi / 2, abs=0.15)  # still stretched


def test_lasting_evidence_of_the_facade_exchanges_the_legs() -> None:
    step = angles(right_hip_x=30, left_hip_x=-20)
    state, frame, bap = TRACKED, FIRST, None
    for frame in range(FIRST, FIRST + 12):
        baps = (changed(partial_bap("1", frame, step), exchange=EXCHANGE_AT / 3), partial_bap("2", frame, step))
        state, bap = pose(state, frame, *baps)
        if directions_of(bap)[2, 0, 2] < 0:
            break
    assert bap is not None
    assert FIRST < frame < FIRST + 11, "exchanged, but not at once"
    found = directions_of(bap)
    expected = limb_directions(TEN_PARTS, step)
    assert degrees_between(found[2, 0], expected[3, 0]) < 10
    assert degrees_between(found[3, 0], expected[2, 0]) < 10


def test_evidence_of_the_flank_does_not_exchange_the_legs() -> None:
    step = angles(right_hip_x=30, left_hip_x=-20)
    state = TRACKED
    for frame in range(FIRST, FIRST + 12):
        state, bap = pose(state, frame, partial_bap("1", frame, step), changed(partial_bap("2", frame, step), exchange=0.5))
        assert directions_of(bap)[2, 0, 2] > 0


def test_the_bap_of_a_single_viewer_has_the_directions_it_observed() -> None:
    lifted = angles(right_hip_x=40, right_knee_x=-50)
    state, _ = play(TRACKED, *(sighting(v, f) for f in (FIRST, FIRST + 1) for v in VIEWERS))
    _, published = play(state, partial_bap("2", FIRST, lifted), partial_bap("2", FIRST + 1, lifted))
    bap = published[0]
    assert isinstance(bap, m.UniversalBap)
    assert bap.stale == ["1"]
    assert set(bap.scores) == {"2"}
    assert np.max(degrees_between(directions_of(bap)[2], limb_directions(TEN_PARTS, lifted)[2])) < 5
