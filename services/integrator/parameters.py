"""Behavioural constants of the integrator: value, unit, provenance.

Provenance: a section of [Two-view], "clips" (tried out on the shared clips walk2, bend2 and kick2, which are therefore no
independent test), or "chosen by hand".
"""

from math import cos, radians

# T-pose  [Two-view 2.4, 4.2]
INSTANTS_OF_BODY = 5  # pairs of partial BDPs whose medians give the universal BDP; chosen by hand
HEIGHTS_AGREE = 0.12  # largest |r_t - 1| of both heights in metres; chosen by hand
STANDS_STILL = 0.03  # spread of the measured heights over their median in one posture; chosen by hand

# Facade and flank  [Two-view 4.3]
VIEWS_SETTLED_NS = 120_000_000  # ns of requests before other views hold: widths vary by a pixel; chosen by hand

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
BACK = radians(135)  # rad from facing the facade viewer from which the back is turned to it; between 90 and 180
BACK_COST = radians(5)  # rad of turn by which the back is nearer, after a right angle, before it is chosen; by hand
SNAP = radians(60)  # rad off the axis of the facade viewer beyond which the body has turned; chosen by hand
FIRST_VIEW_GAIN = 0.5  # share of the angle to the first viewer in choosing front or back; chosen by hand
TURN_COST = 0.02  # log matching score of a turn by one step of YAW_OFFSETS, against noise; clips
FACING_COST = 0.2  # log matching score of standing 45 degrees off the axis of the facade viewer; clips
MOST_TURN = radians(12)  # rad per frame; chosen by hand
SQUAT_LIFTED_M = 0.10  # m, lowering of the navel in a squat with both legs straight down; chosen by hand
SQUAT_M = 0.04  # m, the same in another squat; chosen by hand
STRAIGHT_LEG = radians(5)  # rad from straight down; paper 4.4: 175 to 180 degrees, here to both sides

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

# Frame rate under overload, see `rate_control`
DECISION_NS = 1_000_000_000  # ns between two decisions; health is published once a second
# Ticks at which the decision is sent again after a false one: two of them are OVERTAKEN_NS apart, so that one is followed
# whatever time the false one has (`common.runtime.frame_rate`).
REPEATS = 3
# Shares (keep, of) of the frames that may be processed.  A level has 0.75 to 0.9 of the rate of the one before, so that at
# least 0.75 of what the machine can do comes out; chosen by hand.
RATE_LEVELS = (
    (1, 1), (5, 6), (2, 3), (3, 5), (1, 2), (2, 5), (1, 3), (2, 7), (1, 4), (1, 5), (1, 6), (1, 7), (1, 8), (1, 10),
    (1, 12), (1, 15), (1, 18), (1, 22), (1, 27), (1, 33), (1, 40), (1, 50), (1, 60), (1, 75), (1, 90), (1, 110), (1, 135),
    (1, 165), (1, 200),
)  # fmt: skip
# Shares of the tracker's points and particles.  Measured (docs/measured.md at commit 8523d15f): 20 particles are as good
# as 40; with 100 of 400 points the arms are lost.
DETAIL_LEVELS = (1.0, 0.5)
# Share of the frame sets lost, in two decisions in a row, above which a level fails: one level costs 0.2; chosen by hand.
LOST = 0.10
# Share of overrun frames of one viewer above which it fails at once; a single stall has fewer; chosen by hand.
LOST_AT_ONCE = 0.20
GREATEST_CUT = 0.5  # least ratio of the rates before and after one decision; chosen by hand
SPARE = 0.95  # share of its time that a loop may be expected to work at a higher level; chosen by hand
CALM_NS = 2_000_000_000  # ns without losses before a level that has not failed is tried; chosen by hand
FIRST_WAIT_NS = 4_000_000_000  # ns without losses before a level that has failed is tried again; chosen by hand
LONGEST_WAIT_NS = 64_000_000_000  # ns, longest such wait: each try costs a second or two with losses; chosen by hand
LEAD_NS = 200_000_000  # ns from a decision to the capture time from which it holds: on a loaded network; chosen by hand
SETTLE_NS = 300_000_000  # ns after that in which reports are about both rates; chosen by hand
FEWEST_FRAMES = 4  # least processed frames, or frame sets, for a share; chosen by hand
# Greatest offset of a viewer's capture times from the rig's frame sets before these are moved, and least gain (frame
# periods).  The rates of cameras are never quite those of the rig; chosen by hand.
FARTHEST_PHASE, PHASE_GAIN = 0.35, 0.1
MOST_NAMED = 8  # viewers named as overloaded, which keeps the message short
RECOVERY_TICKS = 2  # decisions before which an earlier integrator's is waited for

# Log
LOG_REQUEST_WAIT_S = 0.5  # s, longest wait for a request; chosen by hand
LOG_REQUEST_PERIOD_S = 1.0  # s, shortest time between two requests that are obeyed; chosen by hand

# Delays of the cameras, see `camera_delays`
DELAY_WINDOW_NS = 20_000_000_000  # ns of silhouettes for one estimate, as of `zenocap sync` of a take
DELAY_REST_NS = 40_000_000_000  # ns between two estimates once two agree: a third of the processor time; chosen by hand
MOST_DELAY_S = 1.0  # s, largest difference of two cameras that is searched; a longer search costs more; chosen by hand
NEXT_CAMERAS = 2  # in the order of the rig with which each camera is compared: seven cameras have 14 pairs; chosen by hand
FEWEST_OUTLINES = 30  # of a view in a window; chosen by hand
DELAYS_AGREE = 0.25  # frame periods, greatest difference of two estimates, and error of a correction; chosen by hand
DELAY_ERRORS = 3.0  # standard errors, greatest difference of two estimates; chosen by hand
# Decisions before which an earlier integrator's correction is waited for: a loaded tracker answers in 1.5 s; chosen by hand
DELAY_RECOVERY_TICKS = 6
DELAY_STEP = 0.25  # frame periods, greatest change of a correction per DECISION_NS; chosen by hand
