"""Before a person is tracked: the first assignments, and the universal body from both viewers' measurements."""

from dataclasses import replace

import numpy as np

from common.body.anatomy import Floats
from common.body.definition import Bdp, Pose
from common.body.proportions import body_from_lengths, lengths_of_height, stretched_angles
from common.camera.pinhole import Camera
from common.conversion import angles_by_name, body_of
from common.messages import Assignment, Message, PartialBdp, Sighting, UniversalBap, UniversalBdp, ViewAssignment
from common.pairing import Instant
from services.integrator.arbitrator import View
from services.integrator.body import integrate_bodies
from services.integrator.perspective import Ray, meeting_depths, scaling_factor
from services.integrator.states import INSTANTS_OF_BODY, Person, Placed, Setup, State

HEIGHTS_AGREE = 0.12  # largest |r_t - 1| after both heights are in metres
STANDS_STILL = 0.03  # spread of the measured heights, over their median, that is still one posture


def place_first(setup: Setup, state: State, instant: Instant[Sighting]) -> tuple[State, list[Message]]:
    """Position and front viewer of a person whose body is not known: an assignment to measure by."""
    seen = {viewer: sighting for viewer, sighting in instant.items.items() if sighting.present}
    if len(seen) < len(setup.cameras):
        return replace(state, bodies=()), []
    wide = [viewer for viewer, sighting in seen.items() if sighting.view == "facade"]
    views: dict[str, View] = dict(state.views)
    if len(wide) == 1:  # whoever sees the stretched arms is the front viewer
        views = {viewer: "facade" if viewer == wide[0] else "flank" for viewer in setup.cameras}
    rays = [Ray(setup.cameras[viewer], seen[viewer].x, seen[viewer].y) for viewer in setup.cameras]
    try:
        depths = meeting_depths(rays[0], rays[1])
    except ValueError as problem:
        return replace(state, bodies=(), problem=str(problem)), []
    position = np.mean([ray.at_depth(depth) for ray, depth in zip(rays, depths, strict=True)], axis=0)
    facade = next(viewer for viewer in setup.cameras if views[viewer] == "facade")
    yaw = facing(setup.cameras[facade])
    placed = Placed(instant.captured_ns, position, yaw, 0.0, 0.0, False, views, ())
    state = replace(state, views=views, first=placed, problem="")
    if setup.height is not None:
        bdp = body_from_lengths(setup.anatomy, lengths_of_height(setup.height))
        return _begin(setup, state, placed, bdp, 1.0, setup.anatomy.neutral, max(s.frame for s in seen.values()))
    frames = {viewer: sighting.frame for viewer, sighting in instant.items.items()}
    return state, [assignment(setup, placed, frames, tracking=False)]


def define_body(setup: Setup, state: State, instant: Instant[PartialBdp]) -> tuple[State, list[Message]]:
    """The universal BDP, once both viewers have measured a standing person in several instants."""
    fronts = [partial for partial in instant.items.values() if partial.side == "front"]
    sides = [partial for partial in instant.items.values() if partial.side == "side"]
    first = state.first
    if state.person is not None or first is None or len(fronts) != 1 or len(sides) != 1:
        return replace(state, bodies=()), []
    bodies = (*state.bodies, (fronts[0], sides[0]))[-INSTANTS_OF_BODY:]
    state = replace(state, bodies=bodies)
    heights = np.array([front.lengths["height"] for front, _ in bodies])
    if len(bodies) < INSTANTS_OF_BODY or np.ptp(heights) > STANDS_STILL * np.median(heights):
        return state, []
    ratio = float(np.median([side.lengths["height"] / front.lengths["height"] for front, side in bodies]))
    if abs(ratio - 1) > HEIGHTS_AGREE:
        problem = f"the viewers see heights {abs(ratio - 1):.0%} apart: check calibration, background and initial posture"
        return replace(state, bodies=(), problem=problem), []
    try:
        bdp, ratio = integrate_bodies(setup.anatomy, [f.lengths for f, _ in bodies], [s.lengths for _, s in bodies])
    except ValueError as problem:
        return replace(state, bodies=(), problem=f"the body cannot be: {problem}"), []
    return _begin(setup, state, first, bdp, ratio, stretched_angles(setup.anatomy), fronts[0].frame)


def _begin(
    setup: Setup, state: State, placed: Placed, bdp: Bdp, ratio: float, angles: Floats, frame: int
) -> tuple[State, list[Message]]:
    """Track a person from this body and these angles on, standing where `placed` says."""
    angles = angles.copy()
    angles[setup.anatomy.index["navel.y"]] = placed.yaw
    pose = Pose(placed.position, angles)
    person = Person(bdp, pose, (placed,), float(placed.position[1]))
    body = UniversalBdp(frame=frame, captured_ns=placed.captured_ns, body=body_of(setup.anatomy, bdp), ratio=ratio)
    messages: list[Message] = [
        body,
        UniversalBap(
            frame=frame, captured_ns=placed.captured_ns, position=point(pose.position),
            angles=angles_by_name(setup.anatomy, angles), scores={}, views=dict(placed.views), stale=[], lost=[],
        ),
    ]  # fmt: skip
    return replace(state, person=person, bodies=(), problem="", said=body), messages


def facing(camera: Camera) -> float:
    """Yaw of a person who looks along a camera's axis into it, radians."""
    forward = camera.rotation[2]
    return float(np.arctan2(-forward[0], -forward[2]))


def assignment(
    setup: Setup, placed: Placed, frames: dict[str, int], *, tracking: bool, arms: int = 0, legs: int = 0
) -> Assignment:
    """frames: each viewer's own frame number, of its last sighting if it is stale.  arms, legs: see `best_way`."""
    return Assignment(
        frame=max(frames.values()), captured_ns=placed.captured_ns, position=point(placed.position), yaw=placed.yaw,
        lean=placed.lean, roll=placed.roll, squatting=placed.squatting, tracking=tracking,
        arms=arms, legs=legs,
        views={
            viewer: ViewAssignment(
                frame=frames[viewer], view=placed.views[viewer], stale=viewer in placed.stale,
                scale=min(scaling_factor(camera, placed.position), 100.0),
            )
            for viewer, camera in setup.cameras.items() if viewer in frames
        },
    )  # fmt: skip


def point(position: Floats) -> tuple[float, float, float]:
    return float(position[0]), float(position[1]), float(position[2])
