"""Messages of two ideal viewers, and the integrator's state after the T-pose."""

import numpy as np

from tests.support.two_view_run import EPOCH_NS, FRAME_NS, VIEWERS, envelope, integrator_setup
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import FRONT_LENGTHS, HIP_HEIGHT, SIDE_LENGTHS, average_lengths
from zenocap.common.body.segments import LIMBS, YAW_OFFSETS
from zenocap.common.conversion import angles_by_name
from zenocap.services.integrator import step as integrator
from zenocap.services.integrator.parameters import INSTANTS_OF_BODY
from zenocap.services.integrator.states import IntegratorState

SETUP = integrator_setup()
HEIGHT = 1.75
HIPS = np.array([0.1, HIP_HEIGHT * HEIGHT, -0.2])
LENGTHS = dict(average_lengths(HEIGHT))
FLAT_TURNS = [-0.1] * len(YAW_OFFSETS)


def sighting(viewer: str, frame: int, at: Floats = HIPS, *, view: m.View | None = None, present: bool = True) -> m.Sighting:
    """Sighting by an ideal viewer of a person whose navel is at `at` (3,); viewer 1 is in front."""
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
        frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS, viewer=viewer, side=side,
        lengths={name: float(scale * LENGTHS[name]) for name in names},
    )  # fmt: skip


def partial_bap(viewer: str, frame: int, pose: Floats) -> m.PartialBap:
    matches = {limb: m.LimbMatch(score=0.9, visible=1.0, matchings=[7]) for limb in LIMBS}
    angles_by_joint = {
        name: angle for name, angle in angles_by_name(TEN_PARTS, pose).items() if not name.startswith(("navel", "neck"))
    }
    return m.PartialBap(
        frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS, viewer=viewer, view="facade" if viewer == "1" else "flank",
        angles=angles_by_joint, limbs=matches, exchange=-0.1, score=0.8,
    )  # fmt: skip


def play(state: IntegratorState, *messages: m.Message) -> tuple[IntegratorState, list[m.Message]]:
    published: list[m.Message] = []
    for message in messages:
        state, more = integrator.step(SETUP, state, envelope(message))
        published += more
    return state, published


def measured() -> tuple[IntegratorState, list[m.Message]]:
    """State with a person tracked after the T-pose."""
    state, published = integrator.initial_state(SETUP), []
    for frame in range(INSTANTS_OF_BODY):
        for message in (*(sighting(v, frame) for v in VIEWERS), *(partial_bdp(v, frame) for v in VIEWERS)):
            state, more = play(state, message)
            published += more
    return state, published


TRACKED, INITIAL_MESSAGES = measured()
FIRST = INSTANTS_OF_BODY  # the next frame
