"""Constants of the verdict, with unit, meaning and provenance."""

# Evidence.
SAMPLE_NS = 250_000_000  # between silhouettes that are compared with the body
PAIRED_NS = 50_000_000  # greatest difference of the capture times of a pose and its silhouettes
STRETCH_NS = 1_000_000_000
LONG_SIDE_PX = 160  # of the reduced images
TOLERANCE_PX = 1  # of the reduced image: edges of body and silhouette may be so far apart
MIN_AREA = 0.001  # of the image: smaller silhouettes are empty
PERSON_AREA = 0.25  # of the usual area of a view's silhouette; a smaller one does not show that the person is there
START_NS = 1_500_000_000  # in view; the tracker starts within 1.2 s
START_SHARE = 0.2  # of the time in view, START_NS at most: 1.5 s of a take of 2.5 s are more than half of it; by hand
OFTEN_SEEN = 0.3  # of the reports of a camera, from which other people or a scene with one cause lost poses; chosen by hand
MANY_OCCUPIED = 30.0  # %, of the images of the empty scene, from which what was learnt in the others is doubtful; by hand
OFTEN_HALF = 0.6  # of the silhouettes of a camera that the border or a thing cuts above or below; chosen by hand
# Of the image's height; of the usual width of a row, at this part of the silhouette's height; chosen on simulated people.
LINE_STAYS, LINE_WIDE, LINE_PART = 0.01, 0.6, 70
UNSTEADY = 0.25  # mean change of the logarithm of an area between samples; of a person at the border of an image up to 0.22
HEAD_APART_M = 0.2  # of the rays through the upper ends of the silhouettes: a raised hand or a wrong calibration; by hand
LEGS_ABOVE_M = 0.25  # of a lower end over the floor, half a shank: a step or a jump is shorter; chosen by hand
HEADS_M, LEGS_MOST = (1.0, 2.4), 0.6  # heights of heads, and share of it up to which legs may be missing; chosen by hand
MOST_HEADS = 240  # samples in which legs are looked for, a minute of a take; chosen by hand
# Faults of the rig, of silhouettes at the same time; chosen on simulated people, `tests/tools/judge/test_wrong_inputs.py`.
MOST_SETS, FEWEST_SETS = 24, 6
HOLDS, HOLDS_NOT, HOLDS_MORE = 0.85, 0.6, 0.15  # share of them: a hypothesis holds, does not, and more than another kind
MOST_PERMUTED, MOST_EXCHANGED = 4, 16  # cameras of which all orders are tried, and exchanges of two: more take minutes
UNITS_M = {"feet": 0.3048, "inches": 0.0254, "centimetres": 0.01, "millimetres": 0.001}  # of calibrations
FAST_TRUNK, FAST_LIMB = 7.0, 12.0  # m/s: no part of a moving person is faster, in ordinary motion
LONGEST_STEP_S = 0.25  # between poses, for a speed
# Without poses and silhouettes; a longer gap counts as this long.  A clock that is set while it records makes one of
# decades, whose stretches would fill the memory.
LONGEST_GAP_NS = 3_600_000_000_000
MOST_STEPS = 2.5  # usual times between poses, from which poses between two are missing: one may be interpolated
LIMIT_RAD = 0.01  # from the end of a joint's range
LEAST_SINE = 0.05  # of a ray to the baseline of two views, as in `common/lags/tangents.py`
FEET_SHARE = 0.15  # of the elevations of an outline, the lowest: tangents there are at the feet; chosen by hand
MOST_DISAGREEMENT_M, MOST_SHAKING = 0.5, 5.0  # m, m/s: greater ones count as these

# Classes.  Of the true error; the expected one has thresholds of its own below.
GOOD_ERROR_M, GOOD_LOST = 0.075, 0.05  # mean error of the joints; share of joints without estimate or 250 mm off
UNUSABLE_ERROR_M, UNUSABLE_LOST = 0.150, 0.25
LOST_ERROR_M = 0.5  # of a frame without a pose, and the greatest of a frame

# Scale and largest value of every feature in the model of the expected error.
SCALES = {
    "outside": (0.02, 1.0), "outside, all views": (0.02, 1.0), "uncovered": (0.02, 1.0),
    "uncovered, all views": (0.02, 1.0),
    "apart": (0.8, 32.0), "cut": (1.0, 1.0), "hidden": (0.1, 1.0), "empty": (0.25, 1.0), "unused": (0.25, 1.0),
    "limbs": (1.0, 1.0), "worst limb": (1.0, 1.0), "heading": (0.02, 1.0), "jumps": (0.05, 1.0), "shaking": (1.0, 5.0),
    "passes": (0.05, 0.5), "limits": (0.1, 1.0), "average body": (1.0, 1.0), "few views": (1.0, 1.0),
}  # fmt: skip

# Fitted to simulated people with faults at commit 8523d15, by the program of that commit, those of two-view to its own
# takes; `python -m benchmarks verdict` checks them on others.  Those that are not here are 0.  "apart" was a ratio of
# lengths: its scale is that ratio in px of those takes, of 17 mm.  Of two-view "apart" and the constant were fitted again,
# to persons from 600 on.
CONSTANTS = {"both-ways": 2.333, "one-pass": 2.307, "two-view": 3.88, "poses-only": 2.348}
COEFFICIENTS: dict[str, dict[str, float]] = {
    "both-ways": {
        "outside, all views": 0.072, "apart": 0.05, "cut": 0.292, "empty": 0.107, "limbs": 0.271, "worst limb": 0.505,
        "heading": 0.21, "jumps": 0.133, "shaking": 0.468, "passes": 0.129, "limits": 1.153, "average body": 0.144,
        "few views": 0.938,
    },
    "one-pass": {
        "outside, all views": 0.078, "apart": 0.039, "cut": 0.285, "limbs": 0.32, "worst limb": 0.641, "heading": 0.223,
        "shaking": 0.633, "limits": 1.161, "average body": 0.299, "few views": 0.898,
    },
    "two-view": {
        "outside": 0.11, "outside, all views": 0.103, "uncovered": 0.089, "uncovered, all views": 0.154, "apart": 0.343,
        "empty": 0.247, "jumps": 0.052, "limits": 0.291,
    },
    "poses-only": {
        "limbs": 0.587, "worst limb": 0.863, "heading": 0.25, "shaking": 0.616, "limits": 1.266, "average body": 0.296,
        "few views": 0.751,
    },
}  # fmt: skip
# By kind and feature: its share of ln error in the stretches of good takes, median.
BASELINE: dict[str, dict[str, float]] = {
    "both-ways": {
        "outside, all views": 0.006, "apart": 0.036, "cut": 0.0, "empty": 0.0, "limbs": 0.049, "worst limb": 0.141,
        "heading": 0.049, "jumps": 0.0, "shaking": 0.245, "passes": 0.042, "limits": 0.129, "average body": 0.0,
        "few views": 0.38,
    },
    "one-pass": {
        "outside, all views": 0.006, "apart": 0.029, "cut": 0.0, "limbs": 0.058, "worst limb": 0.176, "heading": 0.05,
        "shaking": 0.344, "limits": 0.145, "average body": 0.0, "few views": 0.364,
    },
    "two-view": {
        "outside": 0.044, "outside, all views": 0.028, "uncovered": 0.089, "uncovered, all views": 0.134, "apart": 0.147,
        "empty": 0.0, "jumps": 0.0, "limits": 0.037,
    },
    "poses-only": {
        "limbs": 0.106, "worst limb": 0.237, "heading": 0.056, "shaking": 0.335, "limits": 0.158, "average body": 0.0,
        "few views": 0.305,
    },
}  # fmt: skip
# Thresholds, of the same takes.
GOOD_EXPECTED_M, UNUSABLE_EXPECTED_M = 0.075, 0.120
CLEAR_OUTSIDE, CLEAR_UNCOVERED = 0.15, 0.15
CLEAR_SHARE = 0.2
# px of tangents, silhouettes of persons 600 to 659 at 320 x 240: without a fault 99 % of the stretches have less than 1.1
# above the feet, at 160 x 120 0.7, and 0.6 more at the feet, with a shadow 6 more.  Those of colour images have up to 1.7.
CLEAR_APART, NOTED_APART, NOTED_FEET = 2.5, 1.7, 1.5
# Shares of the squared contradiction that a constant, and the speed, explain: of the same with wrong calibrations 0.6 to 1
# and mostly less than 0.2, with late videos less than 0.1 and 0.2 to 0.8, or more than 0.3 of both where the person walks
# one way.  Samples of a lag that is not stated otherwise: with lags up to 1 s it seems to be up to 6, in 1 of 32 takes 6.4.
STAYS, GROWS, CAUSE_SAMPLES = 0.5, 0.2, 6

# Lags of views.  Their certainty is that of `zenocap sync` (`common/lags/tangents.py`), but for their errors: in words.
LAG_ERROR_S = 0.03  # largest standard error of a lag that is stated
LAG_NS = 20_000_000_000  # length of the part of the silhouettes in which lags are looked for, from the first person on
LAG_STEP_NS = 14_000_000  # between silhouettes that are kept for it: 60 a second
MOST_LAG_S = 5.0
# s, and standard errors, from which a lag is stated; faults of silhouettes look like lags of up to 0.09 s.
LEAST_LAG_S, LAG_ERRORS = 0.1, 3.0

# Reasons.
NOTABLE = 0.15  # of ln error: 16 % more error
NOTABLE_VIEW = 0.7  # of the worst view's figure: views with as much are named too
SHOWN_SHARE = 0.9  # of the stretches; a reason that holds in more of them holds always
MOST_REASONS = 5
LAG_WEIGHT = 3.0  # of a lag, as of ln error: before all others, because it has a remedy
FEET_WEIGHT = 0.3  # of views apart at the feet, as of ln error: where it is so for half of the time; chosen by hand
