"""Constants of the drift check, with unit and provenance.  Simulated people: `benchmarks/drift.py`."""

LEAST_INSTANTS, MOST_INSTANTS = 12, 150  # compared instants; more than the latter bring little; chosen by hand
PRIOR_TURN_DEG, PRIOR_SHIFT_M = 5.0, 0.05  # standard deviations of a motion that is not yet known; chosen by hand
LOSS_SCALE = 3.0  # standard deviations beyond which a difference counts less: shadows, a person cut by furniture
LEAST_PX = 1.5  # motion of the person in the image below which no camera is named: errors of silhouettes
BLOCKS = 5  # of the jackknife; chosen by hand
LEAST_ERROR_PX = 0.1  # what silhouettes have in common at all times is no part of the jackknife
SURE_ERRORS = 4.0  # standard errors of that motion, from which it is certain
EXPLAINED = 0.3  # least share of the disagreement of its pairs that the motion has to explain
SAME_DEG, SAME_M = 0.01, 0.001  # within which a calibration is that of a take; chosen by hand
MUCH_PX = (
    3.0  # median disagreement of a pair, from which something is wrong; silhouettes of simulated people have 0.5 to 0.8
)
