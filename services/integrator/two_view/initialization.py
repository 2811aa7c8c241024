"""Initialization: first assignments, universal BDP from both viewers.  [Two-view 2.4, 4.2]"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.proportions import (
    PAPER_TORSO_SHARE,
    TORSO_SHARE,
    average_lengths,
    body_from_lengths,
    body_from_paper_lengths,
    t_pose_angles,
)
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.messages import Assignment, Message, PartialBdp, Sighting, UniversalBap, UniversalBdp, ViewAssignment
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.synchronizer import FrameSet
from zenocap.services.integrator.parameters import HEIGHTS_AGREE, INSTANTS_OF_BODY, STANDS_STILL
from zenocap.services.integrator.states import AssignedRootPose, IntegratedPerson, IntegratorSetup, IntegratorState
from zenocap.services.integrator.two_view.arbitrator import View
from zenocap.services.integrator.two_view.perspective import Ray, intersection_depths, scaling_factor


def assign_first(
    setup: IntegratorSetup, state: IntegratorState, frame_set: FrameSet[Sighting]
) -> tuple[IntegratorState, list[Message]]:
    """First assignment, for measuring: position and front viewer of a person without a body."""
    sightings = {viewer: sighting for viewer, sighting in frame_set.items.items() if sighting.present}
    if len(sightings) < len(setup.cameras):
        return replace(state, bodies=()), []
    wide = [viewer for viewer, sighting in sightings.items() if sighting.view == "facade"]
    views: dict[str, View] = dict(state.views)
    # Paper (replaced): in 2.4 and 4.3 viewer 1 is the front viewer; here the one that shows both arms.
    if len(wide) == 1:  # the viewer with both arms in view is the front viewer
        views = {viewer: "facade" if viewer == wide[0] else "flank" for viewer in setup.cameras}
    rays = [Ray(setup.cameras[viewer], sightings[viewer].x, sightings[viewer].y) for viewer in setup.cameras]
    try:
        depths = intersection_depths(rays[0], rays[1])
    except ValueError as error:
        return replace(state, bodies=(), problem=str(error)), []
    position = np.mean([ray.at_depth(depth) for ray, depth in zip(rays, depths, strict=True)], axis=0)
    facade = next(viewer for viewer in setup.cameras if views[viewer] == "facade")
    yaw = facing(setup.cameras[facade])
    placed = AssignedRootPose(frame_set.captured_ns, position, yaw, 0.0, 0.0, False, views, ())
    state = replace(state, views=views, first=placed, problem="")
    if setup.height is not None:
        bdp = body_from_lengths(setup.anatomy, average_lengths(setup.height))
        return _begin(setup, state, placed, bdp, 1.0, setup.anatomy.neutral, max(s.frame for s in sightings.values()))
    frames = {viewer: sighting.frame for viewer, sighting in frame_set.items.items()}
    return state, [assignment(setup, placed, frames, tracking=False)]


def define_body(
    setup: IntegratorSetup, state: IntegratorState, frame_set: FrameSet[PartialBdp]
) -> tuple[IntegratorState, list[Message]]:
    """Universal BDP, once both viewers have measured a standing person in INSTANTS_OF_BODY frame sets."""
    fronts = [partial for partial in frame_set.items.values() if partial.side == "front"]
    sides = [partial for partial in frame_set.items.values() if partial.side == "side"]
    first = state.first
    if state.person is not None or first is None or len(fronts) != 1 or len(sides) != 1:
        return replace(state, bodies=()), []
    bodies = (*state.bodies, (fronts[0], sides[0]))[-INSTANTS_OF_BODY:]
    state = replace(state, bodies=bodies)
    # Paper (added): 2.4 measures one image; here medians of several frame sets of a person who stands still.
    heights = np.array([front.lengths["height"] for front, _ in bodies])
    if len(bodies) < INSTANTS_OF_BODY or np.ptp(heights) > STANDS_STILL * np.median(heights):
        return state, []
    ratio = float(np.median([side.lengths["height"] / front.lengths["height"] for front, side in bodies]))
    if abs(ratio - 1) > HEIGHTS_AGREE:
        problem = f"the heights in both views differ by {abs(ratio - 1):.0%}: check calibration, background and T-pose"
        return replace(state, bodies=(), problem=problem), []
    try:
        fronts_m, sides_m = [front.lengths for front, _ in bodies], [side.lengths for _, side in bodies]
        bdp, ratio = integrate_bodies(setup.anatomy, fronts_m, sides_m, setup.additions)
    except ValueError as error:
        return replace(state, bodies=(), problem=f"the measured body is impossible: {error}"), []
    return _begin(setup, state, first, bdp, ratio, t_pose_angles(setup.anatomy), fronts[0].frame)


def _begin(
    setup: IntegratorSetup,
    state: IntegratorState,
    placed: AssignedRootPose,
    bdp: Bdp,
    ratio: float,
    angles: Floats,
    frame: int,
) -> tuple[IntegratorState, list[Message]]:
    """Start tracking a person with this body and these joint angles at the assigned position."""
    angles = angles.copy()
    angles[setup.anatomy.index["navel.y"]] = placed.yaw
    pose = Pose(placed.position, angles)
    person = IntegratedPerson(bdp, pose, (placed,), float(placed.position[1]))
    body = UniversalBdp(frame=frame, captured_ns=placed.captured_ns, body=body_of(setup.anatomy, bdp), ratio=ratio)
    messages: list[Message] = [
        body,
        UniversalBap(
            frame=frame, captured_ns=placed.captured_ns, position=point(pose.position),
            angles=angles_by_name(setup.anatomy, angles), scores={}, views=dict(placed.views), stale=[], lost=[],
        ),
    ]  # fmt: skip
    return replace(state, person=person, bodies=(), problem="", published_body=body), messages


def facing(camera: Camera) -> float:
    """Yaw of a person facing a camera, radians."""
    forward = camera.rotation[2]
    return float(np.arctan2(-forward[0], -forward[2]))


def assignment(
    setup: IntegratorSetup,
    placed: AssignedRootPose,
    frames: dict[str, int],
    *,
    tracking: bool,
    arms: int = 0,
    legs: int = 0,
) -> Assignment:
    """Assignment message.  frames: frame number of each viewer, of its last sighting if stale.  arms, legs: hypotheses."""
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
    """Position (3,) as a tuple, for messages."""
    return float(position[0]), float(position[1]), float(position[2])


def integrate_bodies(
    anatomy: Anatomy,
    fronts: Sequence[Mapping[str, float]],
    sides: Sequence[Mapping[str, float]],
    additions: Additions = IMPROVED,
) -> tuple[Bdp, float]:
    """Universal BDP and r_t, in the scale of the front viewer: SR_torso,u = SR_torso,2 / r_t.  [Two-view 4.2]

    fronts, sides: lengths in metres of both viewers in the same frames, of which the medians are taken.  Raises ValueError
    for a body outside of the range of people.
    """
    # Paper (replaced): 4.2 scales BDPs in px of viewer 1; here lengths are metres, and r_t near 1 checks the calibration.
    front, side = _medians(fronts), _medians(sides)
    ratio = side["height"] / front["height"]  # r_t = t2 / t1  [Two-view 4.2]
    depths = {name: side[name] / ratio for name in ("torso_depth", "head_depth") if name in side}
    if "body" in additions:
        return body_from_lengths(anatomy, front | depths), ratio
    share = TORSO_SHARE if "proportions" in additions else PAPER_TORSO_SHARE
    return body_from_paper_lengths(anatomy, front | depths, share), ratio


def _medians(frames: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {name: float(np.median([frame[name] for frame in frames])) for name in frames[0]}
