"""Each instant's assignment: where the person stands, how the torso turns, who sees the facade.  [Two-view 4.2, 4.3]"""

from collections.abc import Mapping
from dataclasses import replace
from math import cos, pi, radians

import numpy as np

from common.body.anatomy import Floats
from common.body.definition import Pose
from common.body.limbs import limb_angles, limb_directions
from common.body.torso import TURNS, tilt_of_spine, torso_rotation, width_thresholds
from common.messages import Message, Sighting
from common.pairing import Instant
from services.integrator.arbitrator import Claim, View, arbitrate
from services.integrator.integration import ARM_COST, LEG_COST, best_way, is_squatting, spine_after, turn_of_body
from services.integrator.measuring import assignment, facing
from services.integrator.perspective import Ray, meeting_depths
from services.integrator.states import Person, Placed, Setup, State

KEPT_PLACES = 4
WALKING = 0.4  # m/s: slower steps say nothing of where somebody faces
MOST_BACKWARDS, FORGOTTEN_S = 0.5, 1.5  # metres; whoever walks further backwards than this faces the other way
UPRIGHT = cos(radians(25))  # a torso bent further than this is no longer as wide as its columns
SETTLED_NS = 120_000_000  # for which the arbitrator must ask for other views: widths are uncertain by a pixel
KEPT_TOES = 0.85  # memory of where the feet point, per frame
TOES_WORTH = 30.0  # radians of turn that a metre of feet is worth in choosing between front and back
SNAP = radians(60)  # a body further off the facade viewer's axis than this has turned


def place_person(setup: Setup, state: State, instant: Instant[Sighting]) -> tuple[State, list[Message]]:
    """The assignment of one instant.  With one viewer's sighting the other's part stays as it was, marked stale."""
    person = state.person
    seen = {viewer: sighting for viewer, sighting in instant.items.items() if sighting.present}
    if person is None or not seen:
        return state, []
    stale = tuple(viewer for viewer in setup.cameras if viewer not in seen)
    position = _position(setup, person, seen)
    asked = _views(setup, state, seen, position)
    asked_ns = 0 if asked == state.views else state.asked_ns or instant.captured_ns
    views = asked if instant.captured_ns - asked_ns >= SETTLED_NS else dict(state.views)
    person = replace(person, toes=_toes(person, seen))
    yaw, lean, roll = _torso(setup, person, seen, position, views)
    backwards = _backwards(person, instant.captured_ns, position)
    if backwards > MOST_BACKWARDS:
        person = replace(person, pose=_about_face(setup, person.pose))
        yaw, lean, roll, backwards = _wrapped(yaw + pi), -lean, -roll, 0.0
    index = setup.anatomy.index
    hips = tuple(float(person.pose.angles[index[f"{side}_hip.z"]]) for side in ("right", "left"))
    squatting = is_squatting(float(position[1]), person.height, (hips[0], hips[1]), person.stance)
    placed = Placed(instant.captured_ns, position, yaw, lean, roll, squatting, views, stale)
    person = replace(person, placed=(*person.placed, placed)[-KEPT_PLACES:], backwards=backwards)
    frames = {viewer: state.last[viewer].frame for viewer in setup.cameras if viewer in state.last}
    both = list(seen.values()) if not stale else []
    arms = best_way([sighting.arms for sighting in both], ARM_COST)
    legs = best_way([sighting.legs for sighting in both], LEG_COST)
    answer = assignment(setup, placed, frames, tracking=True, arms=arms, legs=legs)
    return replace(state, person=person, views=views, asked_ns=asked_ns), [answer]


def _position(setup: Setup, person: Person, seen: Mapping[str, Sighting]) -> Floats:
    """(3,) navel: where the rays meet; a lone viewer's ray at the last depth."""
    rays = [Ray(setup.cameras[viewer], sighting.x, sighting.y) for viewer, sighting in seen.items()]
    if len(rays) == 2:
        try:
            depths = meeting_depths(rays[0], rays[1])
            return np.asarray(np.mean([ray.at_depth(d) for ray, d in zip(rays, depths, strict=True)], axis=0))
        except ValueError:
            pass  # two sightings that do not meet: each alone, the first one's counts
    camera = rays[0].camera
    depth = float(camera.rotation[2] @ person.pose.position + camera.translation[2])
    return rays[0].at_depth(depth)


def _torso(
    setup: Setup, person: Person, seen: Mapping[str, Sighting], position: Floats, views: Mapping[str, View]
) -> tuple[float, float, float]:
    """Yaw, lean and roll: both viewers' tilts about their axes, and the turn that explains both pictures best."""
    index, angles = setup.anatomy.index, person.pose.angles
    yaw, lean, roll = (float(angles[index[f"navel.{axis}"]]) for axis in "yxz")
    tilts = []
    for viewer, sighting in seen.items():
        ray = position - setup.cameras[viewer].centre
        tilts.append((sighting.tilt, ray / np.linalg.norm(ray)))
    spine = spine_after(torso_rotation(yaw, lean, roll)[:, 1], tilts)
    off_axis = _off_axis(setup, yaw, views)
    if abs(off_axis) > SNAP:  # the arbitrator has seen a turn that the torso's own search has not
        yaw = _turned_to(setup, person, yaw, views)
    elif spine[1] > UPRIGHT:
        profiles = [sighting.turns for sighting in seen.values() if len(sighting.turns) == len(TURNS)]
        if profiles:
            yaw += turn_of_body(profiles, TURNS, off_axis)
    limits = setup.anatomy.limits
    lean, roll = tilt_of_spine(spine, yaw)
    lean = float(np.clip(lean, *limits[index["navel.x"]]))
    return _wrapped(yaw), lean, float(np.clip(roll, *limits[index["navel.z"]]))


def _backwards(person: Person, captured_ns: int, position: Floats) -> float:
    """Metres walked backwards of late: people face where they walk, which settles what a silhouette cannot."""
    last = person.placed[-1]
    seconds = (captured_ns - last.captured_ns) / 1e9
    if not 0 < seconds < FORGOTTEN_S:
        return 0.0
    step = position - last.position
    forward = float(step[0] * np.sin(last.yaw) + step[2] * np.cos(last.yaw))
    walked = person.backwards * float(np.exp(-seconds / FORGOTTEN_S))
    return max(0.0, walked - forward) if abs(forward) > WALKING * seconds else walked


def _about_face(setup: Setup, pose: Pose) -> Pose:
    """The same body the other way round: what was taken for the right side is the left one."""
    directions = limb_directions(setup.anatomy, pose.angles)[[1, 0, 3, 2]] * np.array([-1.0, 1.0, -1.0])
    angles = pose.angles.copy()
    index = setup.anatomy.index
    angles[index["navel.y"]] = _wrapped(float(angles[index["navel.y"]]) + pi)
    angles[[index["navel.x"], index["navel.z"]]] *= -1
    return Pose(pose.position, limb_angles(setup.anatomy, directions, angles))


def _toes(person: Person, seen: Mapping[str, Sighting]) -> Mapping[str, float]:
    """How far the feet reach past the shins in each view, over the last frames."""
    before = person.toes
    return {viewer: KEPT_TOES * before.get(viewer, 0.0) + (1 - KEPT_TOES) * s.toes for viewer, s in seen.items()}


def _agreement(setup: Setup, toes: Mapping[str, float], yaw: float) -> float:
    """Metres by which the feet point where a person of this yaw faces; negative for one who faces the other way."""
    front = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    return float(sum(reach * (setup.cameras[viewer].rotation[0] @ front) for viewer, reach in toes.items()))


def _turned_to(setup: Setup, person: Person, yaw: float, views: Mapping[str, View]) -> float:
    """The yaw on the facade viewer's axis after a turn: front or back, whichever is nearer.

    A silhouette of the ten parts cannot tell them apart ([Two-view 5.2 (4)]), but its feet do; facing the first viewer
    again counts for half its angle.
    """
    facade = next(viewer for viewer in setup.cameras if views[viewer] == "facade")
    start = facing(next(iter(setup.cameras.values())))
    front = facing(setup.cameras[facade])

    def cost(candidate: float) -> float:
        turn = abs(_wrapped(candidate - yaw)) + 0.5 * abs(_wrapped(candidate - start))
        return turn - TOES_WORTH * _agreement(setup, person.toes, candidate)

    return min((front, front + pi), key=cost)


def _off_axis(setup: Setup, yaw: float, views: Mapping[str, View]) -> float:
    """How far the body is turned from the facade viewer's axis, front or back to it, in [-90, 90] degrees."""
    facade = next(viewer for viewer in setup.cameras if views[viewer] == "facade")
    off = _wrapped(yaw - facing(setup.cameras[facade]))
    return off - pi * round(off / pi)


def _views(setup: Setup, state: State, seen: Mapping[str, Sighting], position: Floats) -> dict[str, View]:
    """Facade and flank by the arbitrator; unchanged while a viewer is missing."""
    person = state.person
    if person is None or len(seen) < len(setup.cameras):
        return dict(state.views)
    index, angles = setup.anatomy.index, person.pose.angles
    spine = torso_rotation(0.0, float(angles[index["navel.x"]]), float(angles[index["navel.z"]]))[1, 1]
    if spine < UPRIGHT:
        return dict(state.views)
    torso = person.bdp.sizes[setup.anatomy.index["torso"]]
    low, high = width_thresholds(2 * float(torso[2]), 2 * float(torso[1]))
    claims = []
    for viewer, camera in setup.cameras.items():
        depth = float(camera.rotation[2] @ position + camera.translation[2])
        claims.append(Claim(state.views[viewer], seen[viewer].view, seen[viewer].width * depth, low, high))
    first, second = arbitrate(claims[0], claims[1])
    one, two = setup.cameras
    return {one: first, two: second}


def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle + pi) % (2 * pi) - pi)
