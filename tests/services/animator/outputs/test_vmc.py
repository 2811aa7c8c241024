"""VMC output: python-osc and own forward kinematics find the joints of the pose."""

import socket
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_packet import OscPacket
from scipy.spatial.transform import Rotation

from tests.support.virtual_actors import BODIES, PLACES, SHARES, actor_of, centres_of, posed, stretched
from zenocap.common.arrays import Floats
from zenocap.common.rig.animator import VmcTable
from zenocap.services.animator.outputs.vmc import MAX_DATAGRAM_BYTES, VmcOutput
from zenocap.services.animator.states import ActorPose

# Unity's humanoid: parent of every bone, written independently of the tested code.
PARENTS = {
    "Hips": None, "Spine": "Hips", "Chest": "Spine", "Neck": "Chest", "Head": "Neck",
    "LeftShoulder": "Chest", "LeftUpperArm": "LeftShoulder", "LeftLowerArm": "LeftUpperArm", "LeftHand": "LeftLowerArm",
    "RightShoulder": "Chest", "RightUpperArm": "RightShoulder", "RightLowerArm": "RightUpperArm",
    "RightHand": "RightLowerArm", "LeftUpperLeg": "Hips", "LeftLowerLeg": "LeftUpperLeg", "LeftFoot": "LeftLowerLeg",
    "RightUpperLeg": "Hips", "RightLowerLeg": "RightUpperLeg", "RightFoot": "RightLowerLeg",
}  # fmt: skip
JOINTS = {
    "RHip": "RightUpperLeg", "RKnee": "RightLowerLeg", "RAnkle": "RightFoot", "LHip": "LeftUpperLeg",
    "LKnee": "LeftLowerLeg", "LAnkle": "LeftFoot", "RShoulder": "RightUpperArm", "RElbow": "RightLowerArm",
    "RWrist": "RightHand", "LShoulder": "LeftUpperArm", "LElbow": "LeftLowerArm", "LWrist": "LeftHand",
}  # fmt: skip
CLOSE_M = 2e-6  # single precision


class Marionette:
    """A VMC receiver on loopback that uses python-osc only and keeps the last value of every address."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(2.0)
        self.port: int = self._socket.getsockname()[1]
        self.values: dict[str, tuple[object, ...]] = {}
        self.bones: dict[str, Floats] = {}
        self.sizes: list[int] = []
        self._dispatcher = Dispatcher()
        self._dispatcher.map("/VMC/Ext/Bone/Pos", self._bone)
        self._dispatcher.set_default_handler(self._other)

    def listen(self) -> None:
        """Receive all waiting datagrams, at least one."""
        while True:
            data = self._socket.recv(65536)
            self.sizes.append(len(data))
            for timed in OscPacket(data).messages:
                for handler in self._dispatcher.handlers_for_address(timed.message.address):
                    handler.invoke(("127.0.0.1", 0), timed.message)
            self._socket.settimeout(0.0)
            try:
                self._socket.recv(1, socket.MSG_PEEK)
            except BlockingIOError:
                return
            finally:
                self._socket.settimeout(2.0)

    def close(self) -> None:
        self._socket.close()

    def _bone(self, address: str, name: str, *numbers: float) -> None:
        assert len(numbers) == 7
        self.bones[name] = np.array(numbers)

    def _other(self, address: str, *arguments: object) -> None:
        self.values[address] = arguments

    def places(self) -> dict[str, Floats]:
        """Origins of the bones in Unity's world, metres, by forward kinematics of the received values."""
        root = np.array(self.values["/VMC/Ext/Root/Pos"][1:], dtype=float)
        world = {}
        for name, parent in PARENTS.items():
            origin, turn = world[parent] if parent else (root[:3], Rotation.from_quat(root[3:]))
            bone = self.bones[name]
            world[name] = origin + turn.apply(bone[:3]), turn * Rotation.from_quat(bone[3:])
        return {name: origin for name, (origin, _) in world.items()}


@pytest.fixture(scope="module")
def marionette() -> Iterator[Marionette]:
    with closing(Marionette()) as receiver:
        yield receiver


def sent(actor: ActorPose, to: Marionette) -> None:
    output = VmcOutput(VmcTable(port=to.port))
    output.send(actor, None)
    to.listen()


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, position=PLACES)
@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_receivers_kinematics_give_our_joint_centres(
    name: str, shares: Floats, position: Floats, marionette: Marionette
) -> None:
    actor = posed(name, shares, position)
    sent(actor, marionette)
    found, centres = marionette.places(), centres_of(actor)
    for ours, theirs in JOINTS.items():
        np.testing.assert_allclose(found[theirs] * [-1, 1, 1], centres[ours], atol=CLOSE_M, err_msg=ours)


@pytest.mark.parametrize("name", BODIES)
def test_bones_of_a_t_pose_are_not_rotated(name: str, marionette: Marionette) -> None:
    sent(stretched(name), marionette)
    assert set(marionette.bones) == set(PARENTS)
    for bone, numbers in marionette.bones.items():
        np.testing.assert_allclose(numbers[3:], [0, 0, 0, 1], atol=1e-7, err_msg=bone)


@pytest.mark.parametrize("name", BODIES)
def test_the_axes_are_those_of_unity(name: str, marionette: Marionette) -> None:
    """Left-handed: facing +Z, the person's left is at -X; turning to +X is positive about Y; knees bend backwards."""
    sent(stretched(name), marionette)
    places = marionette.places()
    assert places["LeftHand"][0] < places["LeftUpperArm"][0] < 0 < places["RightUpperArm"][0] < places["RightHand"][0]
    assert places["Head"][1] > places["Hips"][1] > places["LeftFoot"][1] > -0.1

    anatomy = BODIES[name][0]
    angles = stretched(name).pose.angles.copy()
    angles[anatomy.index["navel.y"]] = -np.pi / 2  # our +X is the person's left; a quarter turn to the right
    angles[anatomy.index["right_knee.x"]] = -np.pi / 2
    sent(actor_of(name, angles), marionette)
    np.testing.assert_allclose(marionette.bones["Hips"][3:], [0, np.sqrt(0.5), 0, np.sqrt(0.5)], atol=1e-6)
    places = marionette.places()
    assert places["RightHand"][2] < places["LeftHand"][2]  # the right hand points back now
    assert places["RightFoot"][0] < places["RightLowerLeg"][0] - 0.3  # facing +X, the shank goes to -X


def test_the_hips_carry_the_position_and_the_root_stays_at_the_origin(marionette: Marionette) -> None:
    sent(actor_of("ten-parts", stretched("ten-parts").pose.angles, np.array([0.5, 0.9, -0.25])), marionette)
    assert marionette.values["/VMC/Ext/Root/Pos"] == ("root", 0, 0, 0, 0, 0, 0, 1)
    np.testing.assert_allclose(marionette.bones["Hips"][:3], [-0.5, 0.9, -0.25], atol=1e-6)


def test_time_runs_from_the_first_pose_and_no_datagram_is_too_large(marionette: Marionette) -> None:
    output = VmcOutput(VmcTable(port=marionette.port))
    for frame in (100, 130):
        output.send(stretched("fourteen-parts", frame=frame), None)
    marionette.sizes.clear()
    marionette.listen()
    assert marionette.values["/VMC/Ext/T"] == (pytest.approx(0.5),)
    assert marionette.values["/VMC/Ext/OK"] == (1, 3, 0, 1)
    assert len(marionette.sizes) == 4
    assert max(marionette.sizes) <= MAX_DATAGRAM_BYTES
    assert output.counts() == {"sent": 4}


def test_no_bones_are_sent_while_the_person_is_lost(marionette: Marionette) -> None:
    sent(stretched("ten-parts"), marionette)
    marionette.bones.clear()
    output = VmcOutput(VmcTable(port=marionette.port))
    for lost, ok, bones in (("person", (1, 3, 0, 0), set()), ("right_arm", (1, 3, 0, 1), set(PARENTS))):
        output.send(stretched("ten-parts", lost=(lost,)), None)
        marionette.listen()
        assert (marionette.values["/VMC/Ext/OK"], set(marionette.bones)) == (ok, bones)
    output.close()
    marionette.listen()
    assert marionette.values["/VMC/Ext/OK"] == (0, 0, 0, 0)


def test_a_change_of_the_anatomy_changes_the_bones(marionette: Marionette) -> None:
    output = VmcOutput(VmcTable(port=marionette.port))
    for name in BODIES:
        output.send(stretched(name), None)
        marionette.listen()
        wrist = centres_of(stretched(name))["LWrist"]
        np.testing.assert_allclose(marionette.places()["LeftHand"] * [-1, 1, 1], wrist, atol=CLOSE_M)
