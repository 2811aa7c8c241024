"""Bodies and poses of a rig's methods, paired as they arrive."""

import numpy as np
import pytest
from msgspec import structs

from tests.common.bus.test_inbox import bap, sighting
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.conversion import body_of
from zenocap.common.observe.bodies import NO_BODIES, posed, source_of


def body(anatomy: Anatomy) -> m.Body:
    return body_of(anatomy, Bdp(np.full((len(anatomy.parts), 3), 0.1), np.full((len(anatomy.joints), 3), 0.2)))


def tracked(frame: int, kind: type[m.TrackerPose] = m.TrackerPose, *, lost: bool = False) -> m.TrackerPose:
    pose = built(m.TrackerPose, frame=frame, angles={"right_elbow.x": 0.5}, lost=lost, lost_limbs=["right_arm"])
    return m.BothWaysPose(**structs.asdict(pose), backward={}) if kind is m.BothWaysPose else pose


def test_a_pose_has_the_last_body_of_its_source() -> None:
    bodies, found = posed(NO_BODIES, m.UniversalBdp(frame=0, captured_ns=0, body=body(TEN_PARTS), ratio=1.0))
    assert found is None
    bodies, found = posed(bodies, m.TrackerBdp(frame=0, captured_ns=0, body=body(FOURTEEN_PARTS)))
    assert found is None
    for message, source, anatomy in ((bap(4), "two-view", TEN_PARTS), (tracked(5), "tracker", FOURTEEN_PARTS)):
        after, found = posed(bodies, message)
        assert after is bodies
        assert found is not None
        assert (found.source, found.anatomy, found.message) == (source, anatomy, message)
        assert found.body is bodies[found.source].bdp
        np.testing.assert_array_equal(found.pose.position, message.position)
    assert found.pose.angles[FOURTEEN_PARTS.index["right_elbow.x"]] == 0.5
    assert found.lost == ("right_arm",)
    again = posed(bodies, tracked(5, m.BothWaysPose, lost=True))[1]
    assert again is not None
    assert (again.source, again.lost) == ("tracker", ("person",))


def test_a_pose_before_its_body_and_other_messages_have_none() -> None:
    for message in (bap(1), tracked(1), sighting("1", 1)):
        assert posed(NO_BODIES, message) == (NO_BODIES, None)
    assert source_of(sighting("1", 1)) is None


def test_what_cannot_be_used_is_an_error() -> None:
    unknown = structs.replace(body(TEN_PARTS), anatomy="twelve")
    with pytest.raises(ValueError, match="twelve"):
        posed(NO_BODIES, m.TrackerBdp(frame=0, captured_ns=0, body=unknown))
    bodies, _ = posed(NO_BODIES, m.TrackerBdp(frame=0, captured_ns=0, body=body(TEN_PARTS)))
    with pytest.raises(ValueError, match="tail"):
        posed(bodies, structs.replace(tracked(1), angles={"tail.x": 0.0}))
