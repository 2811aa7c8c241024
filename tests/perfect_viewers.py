"""Messages of two viewers that see perfectly, and the integrator's state after the initial posture."""

import numpy as np
from two_view_run import EPOCH_NS, FRAME_NS, VIEWERS, envelope, integrator_setup

from common import messages as m
from common.body.anatomy import TEN_PARTS, Floats
from common.body.limbs import LIMBS
from common.body.proportions import FRONT_LENGTHS, HIP_HEIGHT, SIDE_LENGTHS, lengths_of_height
from common.body.torso import TURNS
from common.conversion import angles_by_name
from services.integrator import step as integrator
from services.integrator.states import INSTANTS_OF_BODY, State

SETUP = integrator_setup()
HEIGHT = 1.75
HIPS = np.array([0.1, HIP_HEIGHT * HEIGHT, -0.2])
LENGTHS = dict(lengths_of_height(HEIGHT))
FLAT_TURNS = [-0.1] * len(TURNS)


def sighting(viewer: str, frame: int, at: Floats = HIPS, *, view: m.View | None = None, present: bool = True) -> m.Sighting:
    """What a perfect viewer sees of a person whose navel is at `at` (3,); viewer 1 sees the front."""
    camera = SETUP.cameras[viewer]
    x, y, depth = camera.rotation @ at + camera.translation
    own: m.View = view or ("facade" if viewer == "1" else "flank")
    width = (0.35 if own == "facade" else 0.24) / depth
    return m.Sighting(
        frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS, viewer=viewer, present=present, x=float(x / depth),
        y=float(y / depth), height=float(HEIGHT / depth), width=float(width), view=own, score=0.9, turns=FLAT_TURNS,
    )  # fmt: skip


def partial_bdp(viewer: str, frame: int, scale: float = 1.0) -> m.PartialBdp:
    side: m.Side = "front" if viewer == "1" else "side"
    names = FRONT_LENGTHS if side == "front" else SIDE_LENGTHS
    return m.PartialBdp(
        frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS, viewer=viewer, side=side, height_px=60.0, score=0.9,
        lengths={name: float(scale * LENGTHS[name]) for name in names},
    )  # fmt: skip


def partial_bap(viewer: str, frame: int, pose: Floats) -> m.PartialBap:
    matches = {limb: m.LimbMatch(score=0.9, visible=1.0, matchings=[7]) for limb in LIMBS}
    named = {
        name: angle for name, angle in angles_by_name(TEN_PARTS, pose).items() if not name.startswith(("navel", "neck"))
    }
    return m.PartialBap(
        frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS, viewer=viewer, view="facade" if viewer == "1" else "flank",
        angles=named, limbs=matches, exchange=-0.1, score=0.8,
    )  # fmt: skip


def play(state: State, *messages: m.Message) -> tuple[State, list[m.Message]]:
    said: list[m.Message] = []
    for message in messages:
        state, more = integrator.step(SETUP, state, envelope(message))
        said += more
    return state, said


def measured() -> tuple[State, list[m.Message]]:
    """A person tracked after the initial posture."""
    state, said = integrator.initial_state(SETUP), []
    for frame in range(INSTANTS_OF_BODY):
        for message in (*(sighting(v, frame) for v in VIEWERS), *(partial_bdp(v, frame) for v in VIEWERS)):
            state, more = play(state, message)
            said += more
    return state, said


TRACKED, BEGINNING = measured()
FIRST = INSTANTS_OF_BODY  # the next frame
