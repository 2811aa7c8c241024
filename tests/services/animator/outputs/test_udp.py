"""UDP output, received by a plain socket and the json module."""

import json
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings

from tests.support.command_receivers import udp_receiver
from tests.support.places import ROOT
from tests.support.virtual_actors import BODIES, PLACES, SHARES, centres_of, posed, stretched
from zenocap.common.arrays import Floats
from zenocap.common.rig.animator import UdpTable
from zenocap.services.animator.outputs.udp import PoseLine, UdpOutput, pose_line
from zenocap.services.animator.states import ActorPose

SCHEMA = ROOT / "docs" / "pose-line.schema.json"
KEYS = ["zenocap", "rig", "frame", "captured_ns", "source", "lost", "searched", "posture", "position", "joints", "angles"]


def line_of(actor: ActorPose) -> dict[str, Any]:
    return json.loads(pose_line("studio", actor, None))


def test_a_receiver_gets_one_line_per_pose() -> None:
    with udp_receiver() as listening:
        output = UdpOutput(UdpTable(port=listening.getsockname()[1]), "studio")
        for frame in range(3):
            output.send(stretched("fourteen-parts", frame=frame), "wave")
            data = listening.recv(65536)
            assert data.endswith(b"}\n")
            assert data.count(b"\n") == 1
            line = json.loads(data)
            assert list(line) == KEYS
            assert (line["zenocap"], line["rig"], line["frame"], line["posture"]) == (1, "studio", frame, "wave")
        assert output.counts() == {"sent": 3}
        output.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, position=PLACES)
@settings(deadline=None, max_examples=30)
def test_joint_centres_and_angles_are_the_actors(name: str, shares: Floats, position: Floats) -> None:
    actor = posed(name, shares, position, frame=7)
    line = line_of(actor)
    for joint, place in centres_of(actor).items():
        np.testing.assert_allclose(line["joints"][joint], place, atol=0.6e-4)
    np.testing.assert_allclose([line["angles"][key] for key in actor.anatomy.angles], actor.pose.angles, atol=1e-5)
    np.testing.assert_allclose(line["position"], position, atol=0.6e-4)
    assert line["captured_ns"] == actor.captured_ns


def test_a_lost_person_has_no_pose() -> None:
    line = line_of(stretched("ten-parts", lost=("person",)))
    assert (line["lost"], line["searched"]) == (True, [])
    assert line["position"] is line["joints"] is line["angles"] is line["posture"] is None


def test_lost_limbs_are_named_and_the_pose_is_sent() -> None:
    line = line_of(stretched("ten-parts", lost=("right_arm",)))
    assert (line["lost"], line["searched"], len(line["joints"])) == (False, ["right_arm"], 15)


@pytest.mark.parametrize("name", BODIES)
def test_every_line_matches_the_schema_and_fits_a_packet(name: str) -> None:
    data = pose_line("studio", posed(name, np.full(25, 0.437), np.array([-1.2345, -0.9876, -1.1111])), "kick-right")
    assert msgspec.json.decode(data, type=PoseLine).joints is not None
    assert len(data) <= 1472


def test_the_documented_schema_is_that_of_the_code() -> None:
    assert json.loads(SCHEMA.read_text()) == msgspec.json.schema(PoseLine)
