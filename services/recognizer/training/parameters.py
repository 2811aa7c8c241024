"""Constants of training posture models and of finding examples, with units and provenance."""

# Examples
MAX_EXAMPLE_GAP_S = 0.25  # longer gaps without angles make an example unusable; chosen by hand
EDGE_FRAMES = 2  # frames at either end of an example that describe how it begins and ends; chosen by hand
EDGE_QUANTILE = 0.95  # of the examples, for `edges`, `reach`, `calm` and `slow` of a model; chosen by hand

# Codebook
LEAST_VARIANCE = 1e-3  # of the largest variance, for directions with less; chosen by hand
KMEANS_RESTARTS = 4  # chosen by hand
VECTOR_DIGITS = 6  # decimals with which vectors count as different

# Hidden Markov models
ITERATIONS, TOLERANCE = 30, 1e-2  # of Baum-Welch; chosen by hand
PRIOR_COUNT = 1e-6  # frames added to every count, so that unused states have probabilities

# Forest
CUTS, CUT_SHARE = 4, 0.2  # descriptions of an example with other ends; largest change of an end; chosen by hand

# Least descriptions in a leaf.  1, 3, 5 and 10 recognize 344 to 350 of 359 with `two-view` and 354 to 356 of 360 with the
# tracker (people 108 to 119, both protocols); files of 3 are smaller than those of 1.  With few
# examples, of which each has CUTS + 1 descriptions, it is 1; from how many on was chosen by hand.
LEAF_DESCRIPTIONS, LEAF_FROM_EXAMPLES = 3, 10

# Background
BACKGROUND_STRIDE = 0.5  # of a window's length to the next one; chosen by hand
LEAST_BACKGROUND_S = 2.0  # shorter stretches between gaps are left out; chosen by hand

# Thresholds
MISS_COST = 2.0  # of a missed posture, relative to a false one; chosen by hand
NEAREST, FURTHEST = 1.0, 3.0  # limits of a threshold, in standard deviations below the mean correct score; by hand
LEAST_SPREAD = 0.05  # standard deviation of scores, natural logarithms per frame; chosen by hand
PRIOR_SCORES = 4  # scores with the pooled spread that are added to those of a posture; chosen by hand
FARTHEST_QUANTILE, FARTHEST_FACTOR = 0.99, 1.25  # of held-out distances to codewords, for `farthest`; chosen by hand
LEAST_FARTHEST = 1e-3  # of `farthest`, for examples that equal each other; chosen by hand

# Evaluation of streams
OVERLAP_SHARE = 0.5  # least overlap of a right answer, of the shorter of answer and labelled span; chosen by hand

# Candidates of postures in a motion; all chosen by hand
SPEED_SMOOTHING_S = 0.2  # running mean before speeds
NOISE_FACTOR = 3.0  # speed at which a movement begins, of the median speed of the slowest third of the frames
LEAST_SPEED, MOST_SPEED = 0.6, 6.0  # rad/s, limits of that speed
END_SPEED = 0.5  # share of that speed below which a movement ends
SHORT_PAUSE_S = 0.35  # a pause that never ends a movement
HOLD_S = 2.0  # a pause away from the start that does not end a movement
HELD_SHARE = 0.5  # share of the largest distance from the start beyond which a pause is away from it
LEAST_CANDIDATE_S, LEAST_REACH = 0.3, 0.35  # s and rad
LONGEST_CANDIDATE_S = 20.0
MARGIN_S = 0.1  # added at either end
LIMB_SHARE = 0.5  # of the largest change of an angle: limbs with more are named
