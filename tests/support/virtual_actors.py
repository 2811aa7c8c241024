"""Virtual actors for the tests of the animator: a body of either anatomy in any pose."""

import msgspec
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.pose_tracks import body
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.conversion import bdp_of, body_of
from zenocap.services.animator.states import ActorPose
from zenocap.services.tracker.body.average_body import body_of_height

BODIES: dict[str, tuple[Anatomy, Bdp]] = {
    "ten-parts": (TEN_PARTS, body()), "fourteen-parts": (FOURTEEN_PARTS, body_of_height(1.75)),
}  # fmt: skip
START_NS = 1_700_000_000_000_000_000
SHARES = arrays(np.float64, 25, elements=st.floats(0, 1))
PLACES = arrays(np.float64, 3, elements=st.floats(-2, 2))


def actor_of(
    name: str, angles: Floats, position: Floats | None = None, *, frame: int = 0, lost: tuple[str, ...] = ()
) -> ActorPose:
    """Frame k is captured k 60ths of a second after START_NS."""
    anatomy, bdp = BODIES[name]
    captured_ns = START_NS + frame * 1_000_000_000 // 60
    place = np.array([0.0, 1.0, 0.0]) if position is None else position
    source = "two-view" if anatomy is TEN_PARTS else "tracker"
    return ActorPose(frame, captured_ns, captured_ns, source, anatomy, bdp, Pose(place, angles), lost)


def stretched(name: str, *, frame: int = 0, lost: tuple[str, ...] = ()) -> ActorPose:
    """An actor in T-pose, upright and with both arms sideways, facing Z."""
    return actor_of(name, t_pose_angles(BODIES[name][0]), frame=frame, lost=lost)


def posed(name: str, shares: Floats, position: Floats, *, frame: int = 0, lost: tuple[str, ...] = ()) -> ActorPose:
    """An actor with every joint angle at the given fraction of its range."""
    low, high = BODIES[name][0].limits.T
    return actor_of(name, low + np.resize(shares, len(low)) * (high - low), position, frame=frame, lost=lost)


def at_the_ends(name: str, size: float, place: float, angle: float) -> ActorPose:
    """An actor that a stranger on an open network can send.  size, place: of all parts, metres.  angle: of all joints."""
    anatomy, bdp = BODIES[name]
    usual = body_of(anatomy, bdp)
    sizes, offsets = dict.fromkeys(usual.sizes, (size,) * 3), dict.fromkeys(usual.offsets, (place,) * 3)
    hostile = bdp_of(anatomy, msgspec.structs.replace(usual, sizes=sizes, offsets=offsets))
    pose = Pose(np.full(3, place), np.full(len(anatomy.angles), angle))
    return ActorPose(0, START_NS, START_NS, "tracker", anatomy, hostile, pose)


def centres_of(actor: ActorPose) -> dict[str, Floats]:
    """Joint centres by name, metres, world."""
    rows = joint_centres(actor.anatomy, actor.body, actor.pose)
    return {marker.name: row for marker, row in zip(actor.anatomy.markers, rows, strict=True)}
