"""VRChat output: joint centres as positions, rotations from the T-pose."""

from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from scipy.spatial.transform import Rotation

from tests.services.animator.outputs.test_vmc import CLOSE_M, Marionette
from tests.support.virtual_actors import BODIES, PLACES, SHARES, actor_of, centres_of, posed, stretched
from zenocap.common.arrays import Floats
from zenocap.common.rig.animator import TRACKERS, VrchatTable
from zenocap.services.animator.outputs.vrchat import MAX_DATAGRAM_BYTES, VrchatOutput
from zenocap.services.animator.states import ActorPose

# Numbers of VRChat's trackers and their joints, written independently of the tested code.
JOINTS = {3: "LAnkle", 4: "RAnkle", 5: "LKnee", 6: "RKnee", 7: "LElbow", 8: "RElbow"}
LIMBS = {  # tracker: joints of the limb that it turns with, and that limb's direction in the T-pose, Unity's axes
    5: ("LHip", "LKnee", (0, -1, 0)), 6: ("RHip", "RKnee", (0, -1, 0)),
    7: ("LShoulder", "LElbow", (-1, 0, 0)), 8: ("RShoulder", "RElbow", (1, 0, 0)),
}  # fmt: skip
TO_UNITY = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def vrchat() -> Iterator[Marionette]:
    with closing(Marionette()) as receiver:
        yield receiver


def sent(actor: ActorPose, to: Marionette, **table: object) -> VrchatOutput:
    to.values.clear()
    output = VrchatOutput(VrchatTable(port=to.port, **table))
    output.send(actor, None)
    to.listen()
    return output


def value(receiver: Marionette, tracker: int | str, kind: str) -> Floats:
    numbers = receiver.values[f"/tracking/trackers/{tracker}/{kind}"]
    assert len(numbers) == 3
    return np.array(numbers, dtype=float)


def turned(receiver: Marionette, tracker: int | str) -> Rotation:
    """Rotation of Unity's `Quaternion.Euler`: about Z, then X, then Y, fixed axes."""
    x, y, z = value(receiver, tracker, "rotation")
    return Rotation.from_euler("zxy", [z, x, y], degrees=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, position=PLACES)
@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_positions_are_joint_centres_and_rotations_turn_the_limbs_into_place(
    name: str, shares: Floats, position: Floats, vrchat: Marionette
) -> None:
    actor = posed(name, shares, position)
    sent(actor, vrchat)
    centres = {joint: place * TO_UNITY for joint, place in centres_of(actor).items()}
    for tracker, joint in JOINTS.items():
        np.testing.assert_allclose(value(vrchat, tracker, "position"), centres[joint], atol=CLOSE_M, err_msg=joint)
    np.testing.assert_allclose(value(vrchat, 1, "position"), actor.pose.position * TO_UNITY, atol=CLOSE_M)
    for tracker, (near, far, direction) in LIMBS.items():
        along = centres[far] - centres[near]
        along /= np.linalg.norm(along)
        np.testing.assert_allclose(turned(vrchat, tracker).apply(direction), along, atol=1e-5, err_msg=far)


@pytest.mark.parametrize("name", BODIES)
def test_no_tracker_is_rotated_in_a_t_pose(name: str, vrchat: Marionette) -> None:
    sent(stretched(name), vrchat, head="position-and-yaw")
    for tracker in (*range(1, 9), "head"):
        np.testing.assert_allclose(value(vrchat, tracker, "rotation"), 0, atol=1e-4, err_msg=str(tracker))
    feet, knees, hip, chest = (value(vrchat, tracker, "position")[1] for tracker in (3, 5, 1, 2))
    assert -0.1 < feet < knees < hip < chest < value(vrchat, "head", "position")[1]


def test_a_turn_to_the_right_is_a_positive_yaw(vrchat: Marionette) -> None:
    anatomy = BODIES["fourteen-parts"][0]
    angles = stretched("fourteen-parts").pose.angles.copy()
    angles[anatomy.index["navel.y"]] = -np.pi / 2  # our +X is the person's left
    sent(actor_of("fourteen-parts", angles), vrchat, head="position-and-yaw")
    np.testing.assert_allclose(value(vrchat, 1, "rotation"), [0, 90, 0], atol=1e-4)
    np.testing.assert_allclose(value(vrchat, "head", "rotation"), [0, 90, 0], atol=1e-4)


def test_numbers_do_not_depend_on_the_chosen_trackers(vrchat: Marionette) -> None:
    output = sent(stretched("ten-parts"), vrchat, trackers=("right_foot", "hip"), head="off")
    assert set(vrchat.values) == {f"/tracking/trackers/{n}/{kind}" for n in (1, 4) for kind in ("position", "rotation")}
    assert output.counts() == {"sent": 1}


def test_all_trackers_are_sent_with_the_place_of_the_head(vrchat: Marionette) -> None:
    vrchat.sizes.clear()
    sent(stretched("ten-parts"), vrchat)
    expected = {f"/tracking/trackers/{n}/{kind}" for n in range(1, 9) for kind in ("position", "rotation")}
    assert set(vrchat.values) == {*expected, "/tracking/trackers/head/position"}
    assert len(TRACKERS) == 8
    assert max(vrchat.sizes) <= MAX_DATAGRAM_BYTES


def test_nothing_is_sent_while_the_person_is_lost() -> None:
    output = VrchatOutput(VrchatTable(port=9))
    output.send(stretched("ten-parts", lost=("person",)), None)
    assert output.counts() == {}
    output.close()


def test_a_change_of_the_anatomy_changes_the_trackers(vrchat: Marionette) -> None:
    output = VrchatOutput(VrchatTable(port=vrchat.port))
    for name in BODIES:
        output.send(stretched(name), None)
        vrchat.listen()
        knee = centres_of(stretched(name))["LKnee"] * TO_UNITY
        np.testing.assert_allclose(value(vrchat, 5, "position"), knee, atol=CLOSE_M)
