"""Assignment of a frame set: position, torso, facade and flank.  [Two-view 4.2, 4.3]"""

from collections.abc import Mapping
from dataclasses import replace
from math import pi

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.definition import Pose
from zenocap.common.body.segments import (
    YAW_OFFSETS,
    lean_and_roll,
    limb_angles,
    limb_directions,
    torso_rotation,
    width_thresholds,
)
from zenocap.common.messages import Message, Sighting
from zenocap.common.synchronizer import FrameSet
from zenocap.services.integrator import parameters
from zenocap.services.integrator.states import AssignedRootPose, IntegratedPerson, IntegratorSetup, IntegratorState
from zenocap.services.integrator.two_view.arbitrator import Claim, View, arbitrate
from zenocap.services.integrator.two_view.initialization import assignment, facing
from zenocap.services.integrator.two_view.integration import (
    best_hypotheses,
    is_lowered,
    is_squatting,
    spine_after,
    turn_of_body,
)
from zenocap.services.integrator.two_view.perspective import Ray, intersection_depths, position_of


def assign_pose(
    setup: IntegratorSetup, state: IntegratorState, frames: FrameSet[Sighting]
) -> tuple[IntegratorState, list[Message]]:
    """Assignment of one frame set.  A viewer without a sighting keeps its part, marked stale."""
    person = state.person
    sightings = {viewer: sighting for viewer, sighting in frames.items.items() if sighting.present}
    if person is None or not sightings:
        return state, []
    stale = tuple(viewer for viewer in setup.cameras if viewer not in sightings)
    added = setup.additions
    position = _position(setup, state, person, sightings)
    proposed = _views(setup, state, sightings, position)
    asked_ns = 0 if proposed == state.views else state.asked_ns or frames.captured_ns
    # Paper (added): 4.3 changes the views at once; with the addition turn, after 120 ms.
    settled = frames.captured_ns - asked_ns >= parameters.VIEWS_SETTLED_NS or "turn" not in added
    views = proposed if settled else dict(state.views)
    if "toes" in added:
        person = replace(person, toes=_toes(person, sightings))
    yaw, lean, roll = _torso(setup, person, sightings, position, views)
    backwards = _backwards(person, frames.captured_ns, position) if "toes" in added else 0.0
    if backwards > parameters.BACKWARDS_M:
        person = replace(person, pose=_turned_round(setup, person.pose))
        yaw, lean, roll, backwards = _wrapped(yaw + pi), -lean, -roll, 0.0
    index = setup.anatomy.index
    hips = tuple(float(person.pose.angles[index[f"{side}_hip.z"]]) for side in ("right", "left"))
    squatting = is_lowered(float(position[1]), person.height)
    if "merging" in added:
        squatting = is_squatting(float(position[1]), person.height, (hips[0], hips[1]))
    placed = AssignedRootPose(frames.captured_ns, position, yaw, lean, roll, squatting, views, stale)
    person = replace(person, placed=(*person.placed, placed)[-parameters.ASSIGNMENTS_KEPT :], backwards=backwards)
    numbers = {viewer: state.last[viewer].frame for viewer in setup.cameras if viewer in state.last}
    both = list(sightings.values()) if not stale else []
    arms = best_hypotheses([sighting.arms for sighting in both], parameters.ARM_COST)
    legs = best_hypotheses([sighting.legs for sighting in both], parameters.LEG_COST)
    answer = assignment(setup, placed, numbers, tracking=True, arms=arms, legs=legs)
    return replace(state, person=person, views=views, asked_ns=asked_ns), [answer]


def _position(
    setup: IntegratorSetup, state: IntegratorState, person: IntegratedPerson, sightings: Mapping[str, Sighting]
) -> Floats:
    """(3,) navel: intersection of both rays, or the ray of one viewer at the last depth.  [Two-view Eq. 3]"""
    by_viewer = {viewer: Ray(setup.cameras[viewer], sighting.x, sighting.y) for viewer, sighting in sightings.items()}
    rays = list(by_viewer.values())
    if len(rays) == 2:
        try:
            if "position" not in setup.additions:
                facade, flank = sorted(by_viewer, key=lambda viewer: state.views[viewer] != "facade")
                return position_of(by_viewer[facade], by_viewer[flank])
            # Paper (replaced): Eq. 3 in closed form needs orthogonal cameras; here the intersection of both rays.
            # Paper (replaced): 4.4 takes Y of the facade viewer; here the mean of both.
            depths = intersection_depths(rays[0], rays[1])
            return np.asarray(np.mean([ray.at_depth(d) for ray, d in zip(rays, depths, strict=True)], axis=0))
        except ValueError:
            pass  # the rays do not intersect: the first one alone
    camera = rays[0].camera
    depth = float(camera.rotation[2] @ person.pose.position + camera.translation[2])
    return rays[0].at_depth(depth)


def _torso(
    setup: IntegratorSetup,
    person: IntegratedPerson,
    sightings: Mapping[str, Sighting],
    position: Floats,
    views: Mapping[str, View],
) -> tuple[float, float, float]:
    """Yaw, lean, roll, radians: from the tilts of both viewers about their axes and the turn with the best score."""
    index, angles = setup.anatomy.index, person.pose.angles
    yaw, lean, roll = (float(angles[index[f"navel.{axis}"]]) for axis in "yxz")
    tilts = []
    for viewer, sighting in sightings.items():
        ray = position - setup.cameras[viewer].centre
        tilts.append((sighting.tilt, ray / np.linalg.norm(ray)))
    spine = spine_after(torso_rotation(yaw, lean, roll)[:, 1], tilts)
    off_axis = _off_axis(setup, yaw, views)
    # Paper (open): 3.1 does not decide between front and back to the facade viewer; front, unless the back is turned to it.
    if "turn" not in setup.additions:  # after a change of views both are a right angle away
        front = facing(setup.cameras[_facade(setup, views)])
        yaw = front + pi if abs(_wrapped(yaw - front)) > parameters.BACK else front
    elif abs(off_axis) > parameters.SNAP:  # the views have changed: a turn larger than the search of the yaw finds
        yaw = _turned_to(setup, person, yaw, views)
    elif spine[1] > parameters.UPRIGHT:
        profiles = [sighting.turns for sighting in sightings.values() if len(sighting.turns) == len(YAW_OFFSETS)]
        if profiles:
            yaw += turn_of_body(profiles, YAW_OFFSETS, off_axis)
    limits = setup.anatomy.limits
    lean, roll = lean_and_roll(spine, yaw)
    lean = float(np.clip(lean, *limits[index["navel.x"]]))
    return _wrapped(yaw), lean, float(np.clip(roll, *limits[index["navel.z"]]))


def _backwards(person: IntegratedPerson, captured_ns: int, position: Floats) -> float:
    """Recent distance walked backwards, metres.  People mostly face their walking direction; silhouettes do not show it."""
    # Paper (added): 5.2 (4) leaves the facing direction open; here the walking direction corrects it.
    last = person.placed[-1]
    seconds = (captured_ns - last.captured_ns) / 1e9
    if not 0 < seconds < parameters.BACKWARDS_MEMORY_S:
        return 0.0
    step = position - last.position
    forward = float(step[0] * np.sin(last.yaw) + step[2] * np.cos(last.yaw))
    walked = person.backwards * float(np.exp(-seconds / parameters.BACKWARDS_MEMORY_S))
    return max(0.0, walked - forward) if abs(forward) > parameters.WALKING_M_S * seconds else walked


def _turned_round(setup: IntegratorSetup, pose: Pose) -> Pose:
    """The same pose turned by 180 degrees, with left and right limbs exchanged."""
    directions = limb_directions(setup.anatomy, pose.angles)[[1, 0, 3, 2]] * np.array([-1.0, 1.0, -1.0])
    angles = pose.angles.copy()
    index = setup.anatomy.index
    angles[index["navel.y"]] = _wrapped(float(angles[index["navel.y"]]) + pi)
    angles[[index["navel.x"], index["navel.z"]]] *= -1
    return Pose(pose.position, limb_angles(setup.anatomy, directions, angles))


def _toes(person: IntegratedPerson, sightings: Mapping[str, Sighting]) -> Mapping[str, float]:
    """Smoothed distance of the feet from the shins by viewer, metres."""
    before = person.toes
    return {
        viewer: parameters.TOES_MEMORY * before.get(viewer, 0.0) + (1 - parameters.TOES_MEMORY) * s.toes
        for viewer, s in sightings.items()
    }


def _toes_agreement(setup: IntegratorSetup, toes: Mapping[str, float], yaw: float) -> float:
    """Reach of the feet in the facing direction of this yaw, metres; negative for the opposite direction."""
    front = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    return float(sum(reach * (setup.cameras[viewer].rotation[0] @ front) for viewer, reach in toes.items()))


def _turned_to(setup: IntegratorSetup, person: IntegratedPerson, yaw: float, views: Mapping[str, View]) -> float:
    """Yaw on the axis of the facade viewer after a turn: front or back, whichever is nearer, by the feet if visible."""
    # Paper (added): 5.2 (4) states that a silhouette does not distinguish front from back; here the feet decide.
    start = facing(next(iter(setup.cameras.values())))
    front = facing(setup.cameras[_facade(setup, views)])

    def cost(candidate: float) -> float:
        turn = abs(_wrapped(candidate - yaw)) + parameters.FIRST_VIEW_GAIN * abs(_wrapped(candidate - start))
        return turn - parameters.TOES_GAIN * _toes_agreement(setup, person.toes, candidate)

    return front + pi if cost(front + pi) < cost(front) - parameters.BACK_COST else front


def _off_axis(setup: IntegratorSetup, yaw: float, views: Mapping[str, View]) -> float:
    """Angle of the body from the axis of the facade viewer, front or back to it, in [-pi/2, pi/2]."""
    off = _wrapped(yaw - facing(setup.cameras[_facade(setup, views)]))
    return off - pi * round(off / pi)


def _facade(setup: IntegratorSetup, views: Mapping[str, View]) -> str:
    return next(viewer for viewer in setup.cameras if views[viewer] == "facade")


def _views(
    setup: IntegratorSetup, state: IntegratorState, sightings: Mapping[str, Sighting], position: Floats
) -> dict[str, View]:
    """Facade and flank by arbitration; unchanged without one viewer or for a torso that leans."""
    person = state.person
    if person is None or len(sightings) < len(setup.cameras):
        return dict(state.views)
    index, angles = setup.anatomy.index, person.pose.angles
    spine = torso_rotation(0.0, float(angles[index["navel.x"]]), float(angles[index["navel.z"]]))[1, 1]
    # Paper (added): a torso that leans is narrower than its columns, so 4.3 is not applied.
    if spine < parameters.UPRIGHT:
        return dict(state.views)
    torso = person.bdp.sizes[setup.anatomy.index["torso"]]
    low, high = width_thresholds(2 * float(torso[2]), 2 * float(torso[1]))
    claims = []
    for viewer, camera in setup.cameras.items():
        depth = float(camera.rotation[2] @ position + camera.translation[2])
        claims.append(Claim(state.views[viewer], sightings[viewer].view, sightings[viewer].width * depth, low, high))
    first, second = arbitrate(claims[0], claims[1])
    one, two = setup.cameras
    return {one: first, two: second}


def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle + pi) % (2 * pi) - pi)
