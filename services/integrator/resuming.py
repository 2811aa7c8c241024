"""After a restart: the person goes on with the body and the pose that the integrator before had said last."""

from dataclasses import replace

import numpy as np

from common.body.anatomy import Anatomy
from common.body.definition import Bdp, Pose
from common.conversion import angles_of, bdp_of
from common.messages import Message, UniversalBap, UniversalBdp
from services.integrator.arbitrator import View
from services.integrator.states import Person, Placed, Setup, State


def resume(setup: Setup, state: State, said: UniversalBdp | UniversalBap) -> tuple[State, list[Message]]:
    """Take in what was said before; with the body known, a pose lets the tracking go on.

    What is taken over is said again: for late joiners, for viewers that have lost it meanwhile, and for the take.
    """
    match said:
        case UniversalBdp() if state.said is None and _usable(setup.anatomy, said):
            return replace(state, said=said), [said]
        case UniversalBap() if state.said is not None and set(said.views) == set(setup.cameras):
            bdp = bdp_of(setup.anatomy, state.said.body)
            pose = Pose(np.array(said.position), angles_of(setup.anatomy, said.angles, setup.anatomy.neutral))
            yaw, lean, roll = (float(pose.angles[setup.anatomy.index[f"navel.{axis}"]]) for axis in "yxz")
            views: dict[str, View] = dict(said.views)
            placed = Placed(said.captured_ns, pose.position, yaw, lean, roll, False, views, ())
            person = Person(bdp, pose, (placed,), standing_height(setup.anatomy, bdp))
            return replace(state, person=person, views=views, bodies=(), problem=""), [said]
        case _:
            return state, []


def standing_height(anatomy: Anatomy, bdp: Bdp) -> float:
    """Height of the navel of who stands upright on flat soles, metres: the hips' place and the legs' lengths."""
    hip = next(k for k, joint in enumerate(anatomy.joints) if joint.name == "right_hip")
    legs = sum(
        float(bdp.sizes[k][0]) for k, part in enumerate(anatomy.parts) if part in ("right_upper_leg", "right_lower_leg")
    )
    return legs - float(bdp.offsets[hip][1])


def _usable(anatomy: Anatomy, said: UniversalBdp) -> bool:
    try:
        bdp_of(anatomy, said.body)
    except ValueError:
        return False
    return True
