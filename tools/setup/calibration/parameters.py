"""Behavioural constants of the calibration with a printed board, and of the drift check."""

from typing import Final

# Detection.
MARKER_SHARE: Final = 0.75  # side of a marker by that of its square, of printed boards; OpenCV's tutorials use 0.5 to 0.8
MIN_CORNERS: Final = 6  # of a view: fewer do not fix a pose; chosen by hand
PROBED_FRAMES: Final = 12  # of a camera, evenly spread, that show the variant of the board; chosen by hand
DARK_LEVEL: Final = 25.0  # mean grey of images without a board, below which darkness is named; chosen by hand
MAX_LOOKS: Final = 1500  # frames of a camera in which the board is searched; 25 ms each at 1280 x 720
BURST_S: Final = 0.4  # of a longer video, stretches of this length are searched, evenly spread: motion needs neighbours
# Limits of a corner file.
MAX_FRAMES: Final = 3_000_000  # of a film: a day at 30 frames/s
MAX_VIEWS: Final = 100_000  # of a film, also pictures; MAX_LOOKS and a stretch are searched where the length is known
EDGE_PX: Final = 8.0  # margin of corners outside the image: the largest window of refinement
# Passes of the search for tags of an AprilGrid: magnification, and least contrast in levels, which separates tags from the
# squares that touch them.  Of 540 tags in 15 simulated images, OpenCV's 7 levels found 178, these 271 and 427.
TAG_PASSES: Final = ((1, 22), (2, 15))
FEW_TAGS: Final = 4  # below which the next pass is made; others are predicted from these
TAG_ALIKE: Final = 0.7  # least correlation of the cells of a predicted tag; another tag has 0.5 or less
TAG_BEND: Final = 0.02  # of its side, tolerance of a tag against its neighbours' prediction, and 0.5 px: bent by lenses
MIN_TAG_PX: Final = 22.0  # least side of a tag: of 20 px, its corners are 0.5 px off and more in simulated images
SPACING_PAIRS: Final = 1500  # neighbouring tags that the spacing is measured from; chosen by hand
SPACING_OFF: Final = 0.015  # difference of the measured spacing, from which the given one is wrong

# Choice of instants.
MAX_SHARED: Final = 120  # instants at which several cameras see the board; more lowered no error of simulated boards
MAX_OWN: Final = 25  # further views of each camera, for its lens
CELLS: Final = (6, 4)  # of the image, across and down, that views ought to cover
PAIRED_PERIODS: Final = 0.6  # of the frame period, greatest difference of an instant and a frame
NEIGHBOUR_PERIODS: Final = 2.5  # of the frame period, between frames that give the speed of corners
RESTING_PX: Final = 3.0  # mean motion of the corners, below which the board rests where it was; chosen by hand
SLOW_PX_S: Final = 100.0  # speed of corners that halves the value of a view

# Noise of corners.
CORNER_PX: Final = 0.1  # least standard deviation: what detection reaches in clean images; simulated boards: 0.05 to 0.1
SKEW_S: Final = 0.004  # times the speed: rows that are exposed one after the other, and blur
ROBUST: Final = 2.0  # standard deviations, scale of the soft-L1 loss

# Rolling shutter.
# Chosen on simulated rooms of two cameras, seeds 0 to 4 and 100: without rolling shutter up to 8.3 ms was found where a
# camera was late by part of a frame, whose motion is taken as straight, and up to 0.6 ms in step.
LEAST_READOUT_S: Final = 0.010  # time of readout, from which it is named
# Four standard errors named one camera of 18 without rolling shutter (seeds 30 to 35).
SURE_READOUT: Final = 5.0  # standard errors of it, from which it is certain

# Lenses.
LENS_VIEWS: Final = 30  # of a camera for its first lens
HELD_OUT_GAIN: Final = 0.05  # least relative gain in held-out error of a lens with more coefficients
FISHEYE_GAIN: Final = 0.15  # the same, of a fisheye lens: it costs rectification

# The verdict.
GOOD_ERROR_M: Final = 0.01  # expected error where the board was seen, of a good calibration; chosen by hand
GOOD_FOCAL: Final = 0.01  # relative standard deviation of the focal length; chosen by hand
GOOD_PX: Final = 1.5  # reprojection error at 1280 px width, beyond which something contradicts; chosen by hand
GOOD_SHARED: Final = 8  # instants shared with other cameras, below which more is asked for; chosen by hand
GOOD_COVERAGE: Final = 0.4  # of the cells of an image; chosen by hand
ROLL_DEG: Final = 5.0  # roll of the cameras, against which a guessed vertical is stated
FLOOR_S: Final = 0.5  # around the time at which the board lies on the floor
FLOOR_STILL_PX_S: Final = 15.0  # speed of corners up to which the board lies; chosen by hand

# Drift check.  Checked on simulated people, `python -m benchmarks drift`.
LEAST_INSTANTS: Final = 12  # compared instants; chosen by hand
MOST_INSTANTS: Final = 150  # more bring little
PRIOR_TURN_DEG: Final = 5.0  # standard deviation of a turn that is not yet known; chosen by hand
PRIOR_SHIFT_M: Final = 0.05  # the same, of a shift
LOSS_SCALE: Final = 3.0  # standard deviations beyond which a difference counts less: shadows, a person cut by furniture
LEAST_PX: Final = 1.5  # motion of the person in the image below which no camera is named: errors of silhouettes
BLOCKS: Final = 5  # of the jackknife; chosen by hand
LEAST_ERROR_PX: Final = 0.1  # what silhouettes have in common at all times is no part of the jackknife
SURE_ERRORS: Final = 4.0  # standard errors of that motion, from which it is certain
EXPLAINED: Final = 0.3  # least share of the disagreement of its pairs that the motion has to explain
SAME_DEG: Final = 0.01  # up to which a calibration is that of a take; chosen by hand
SAME_M: Final = 0.001
MUCH_PX: Final = 3.0  # median disagreement of a pair, from which something is wrong; of simulated people 0.5 to 0.8
