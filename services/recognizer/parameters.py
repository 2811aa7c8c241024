"""Behavioural constants of the recognizer, with unit and provenance."""

from zenocap.common.rig import recognizer

# Feature vectors
SHOULDER_MIDDLE = (0.5, -0.6, 0.6)  # middle of an arm's range in the torso frame: outwards, up, forwards; chosen by hand
HIP_MIDDLE = (0.1, -0.85, 0.5)  # the same of a leg; chosen by hand
WAIST_SHARE = 0.35  # height of the spine's bend between hips and shoulders; as in `common.body.inverse_kinematics`

# Standard body of `motion_rows`, in body heights: Drillis and Contini (1966) as in Winter, Biomechanics, 4th ed., fig. 4.1
TRUNK, HEAD = 0.288, 0.182
SHOULDER_HALF, HIP_HALF = 0.129, 0.05
UPPER_ARM, FOREARM = 0.186, 0.146
THIGH, SHANK = 0.245, 0.246

# Description of segments
SPEED_HALF_S = 0.133  # half the time over which velocities are taken; chosen by hand
QUANTILES = (0.05, 0.25, 0.75, 0.95)  # chosen by hand
THIRDS = 3  # parts of a segment whose means describe its course; chosen by hand

# Likelihoods
FILLER_STAY = 0.9  # probability per frame of staying in the filler's extra state; chosen by hand

# Stream
MAX_STREAM_GAP_S = 0.5  # a longer gap between poses restarts segmentation, as a live rig may drop frames; chosen by hand
ANSWER_DELAY_S = 0.3  # from a posture's end to its result, as later frames may prolong it; chosen by hand
CLOCK_RESET_S = 10.0  # a time stamp this much earlier restarts the stream; a smaller step counts as late; chosen by hand
WINDOWS_KEPT = 16  # answered windows that are compared with movements; chosen by hand

# Commands
MAX_COMMAND_AGE_S = 2.0  # of the pose when its posture is published: older ones are of a replay or a stall; chosen by hand
COMMANDS_WAITING = 2  # of one command behind the one that is being performed; further ones are dropped; chosen by hand
MAX_ERROR_BYTES = 400  # of the end of a program's standard error, which its failure contains; chosen by hand
STOP_TIMEOUT_S = 3.0  # for commands that are being performed when the recognizer stops; chosen by hand

# Segmentation
# Least score of a window in shares of `expected_gain`.  Measured on four simulated people (seeds 300 to 303; the model is
# of 200 to 207), ten minutes of two-view tracking with unknown movements: precision and recall 0.80 and 0.88 at 0.12, 0.92
# and 0.85 at 0.18, 0.94 and 0.81 at 0.20.  With true angles 1.00 and 0.95 at all of them.
STRICTNESS = recognizer.STRICTNESS  # of a rig file without it
WINDOW_PRICE = 0.3  # natural logarithms: one window is preferred to two that explain as much; chosen by hand
SHORTEST_WINDOW, LONGEST_WINDOW = 0.75, 1.6  # of the shortest and the longest training example; chosen by hand
WINDOW_REACH = 0.65  # least distance from a window's first frame, of the posture's reach; chosen by hand
SMOOTHING_ROWS = 3  # rows of the running mean before distances are taken; chosen by hand

# Movement detection
COMPARED_S = 0.33  # time between the two moments that are compared; chosen by hand
STILL_S = 0.4  # a movement ends after this long without motion; chosen by hand
MOVING_REACH = 0.25  # distance between the two moments that counts as motion, of the smallest reach; chosen by hand
MOVEMENT_REACH = 0.8  # least distance from a movement's start, of the smallest reach; chosen by hand
SHORTEST_MOVEMENT = 0.6  # of the shortest training example; chosen by hand
EXPLAINED_SHARE = 0.4  # share of a movement that windows must cover to explain it; chosen by hand
