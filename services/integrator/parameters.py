"""Behavioural constants of the integrator: value, unit, provenance.

Provenance: a section of [Two-view], "clips" (tried out on the shared clips walk2, bend2 and kick2, which are therefore no
independent test), or "chosen by hand".
"""

from collections.abc import Mapping
from math import cos, radians

# T-pose  [Two-view 2.4, 4.2]
INSTANTS_OF_BODY = 5  # pairs of partial BDPs whose medians give the universal BDP; chosen by hand
HEIGHTS_AGREE = 0.12  # largest |r_t - 1| of both heights in metres; chosen by hand
STANDS_STILL = 0.03  # spread of the measured heights over their median in one posture; chosen by hand

# Facade and flank  [Two-view 4.3]
VIEWS_SETTLED_NS = (
    120_000_000  # ns for which the arbitrator must request other views: widths vary by a pixel; chosen by hand
)
UPRIGHT = cos(radians(25))  # cosine of the lean beyond which a torso is narrower than its columns; chosen by hand

# Position by the paper  [Two-view 4.1, 4.2]
ORTHOGONAL_COS = 0.002  # cosine of the angle between the views up to which closed Eq. 3 is used; chosen by hand
LEAST_ORIGIN_M = 0.5  # m from a camera to the origin, to which the scaling factors relate; chosen by hand

# Root pose
ASSIGNMENTS_KEPT = 4  # last assignments that partial BAPs may answer; chosen by hand
WALKING_M_S = 0.4  # m/s below which a step does not show the facing direction; chosen by hand
BACKWARDS_M = 0.5  # m walked backwards after which the person is taken to face the other way; chosen by hand
BACKWARDS_MEMORY_S = 1.5  # s, time constant of the distance walked backwards; chosen by hand
TOES_MEMORY = 0.85  # share of the previous toes offset kept per frame; chosen by hand
TOES_GAIN = 30.0  # rad of turn that a metre of toes offset outweighs in choosing front or back; chosen by hand
SNAP = radians(60)  # rad off the axis of the facade viewer beyond which the body has turned; chosen by hand
FIRST_VIEW_GAIN = 0.5  # share of the angle to the first viewer in choosing front or back; chosen by hand
TURN_COST = 0.02  # log matching score of a turn by one step of YAW_OFFSETS, against noise; clips
FACING_COST = 0.2  # log matching score of standing 45 degrees off the axis of the facade viewer; clips
MOST_TURN = radians(12)  # rad per frame; chosen by hand
SQUAT_LIFTED_M = 0.10  # m by which the navel is lowered in a squat with both legs near the stance; chosen by hand
SQUAT_M = 0.04  # m by which it is lowered in a squat otherwise; chosen by hand
STANCE_TOLERANCE = radians(5)  # rad; paper 4.4: 175 to 180 degrees, here about the initial stance

# Limbs  [Two-view 4.4]
ALONG_ARM, ALONG_LEG, ALONG_SQUAT = 0.1, 0.03, 0.3  # weight of a direction along its view axis, 1 across it; by hand
HIDDEN_ARM = 0.02  # weight of a hidden arm, 1 for a fully visible one; chosen by hand
RESTING_ARM = 0.02  # weight of the hanging direction; chosen by hand
ARM_COST, LEG_COST = 0.03, 0.03  # log matching score that a limb hypothesis must gain; chosen by hand
EXCHANGE_BIAS = 0.015  # log matching score per frame: the tracked legs are refined, the exchanged ones are not; clips
EXCHANGE_MEMORY = 0.85  # share of the previous evidence kept per frame; clips
EXCHANGE_AT, EXCHANGE_FLOOR = 0.06, -0.06  # evidence at which the legs are exchanged, and its lower bound; clips

# State recovery
REMINDER_NS = 2_000_000_000  # ns without partial BAPs of a viewer before the body is published again; chosen by hand

# Log
LOG_REQUEST_WAIT_S = 0.5  # s, longest wait for a request; chosen by hand


def parameters() -> Mapping[str, float | int | str | list[float] | list[str]]:
    """The constants of this module by name, as plain values."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in globals().items() if name.isupper()}
