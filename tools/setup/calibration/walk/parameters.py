"""Behavioural constants of the calibration from a person who walks.

Chosen on simulated walkers (`python -m benchmarks walk`, four seeds) unless another source is given.
"""

from typing import Final

# Instants.
PER_S: Final = 6.0  # instants a second: about three for each step
MOST_INSTANTS: Final = 400  # spread over the whole walk
LEAST_INSTANTS: Final = 20  # of two cameras in common
SMOOTHING: Final = 5  # instants of the running median of a track, about one step

# One camera alone.
ROLL_DEG: Final = 6.0  # standard deviation of how far cameras are rolled; by hand
HEIGHT_NOISE_M: Final = 0.1  # of the camera's height as one instant has it: the foot nearest to the camera is lowest
TILTS_DEG: Final = tuple(range(-60, 36, 5))  # from which the search begins

# Registration of two tracks.
NEAR_M: Final = 0.35  # distance of two positions of one person, below which they agree
LEAST_APART_M: Final = 0.8  # of two positions that determine a rotation
TRIALS: Final = 300
LEAST_AGREEING: Final = 0.5  # share of the common instants
MIRRORED: Final = 0.7  # share of the instants at which the mirrored track of a mirrored image agrees

# Delays.
# Of the image plane in which a silhouette's farthest point is interpolated: right to 0.05 % of its size.
DIRECTIONS: Final = 96
LONGEST_GAP_S: Final = 0.15  # between two images that are interpolated; by hand
MOST_DELAY_S: Final = 1.5  # searched
LAG_STEP_S: Final = 0.1  # of the search
TRACK_SMOOTHING_S: Final = 0.8  # running median of a track, about one step
# Standard error beside that of the jackknife: of walkers in step (seeds 0 to 5) -12 to 12 ms are found.
DELAY_BIAS_S: Final = 0.009
DELAY_ERRORS: Final = 3.0  # standard errors from which on a delay is corrected: films in step stay as they are
DELAY_BLOCKS: Final = 5  # stretches of time of the jackknife

# Adjustment.
HEAD_NOISE_M: Final = 0.03  # of the height of the head: it moves up and down by 2 to 4 cm in each step
FLOOR_NOISE_M: Final = 0.1  # of the floor below one instant's lowest point
HEAD_PX: Final = 3.0  # of the top of the head; views from different heights see different points of it
ROUNDS: Final = 3  # outliers are weighted again after each
BLOCKS: Final = 6  # stretches of time of the jackknife

# The person, relative to the stature.  Height of the head over the floor in a walk: simulated walkers 0.998, simulated
# people with motions of CMU (02_01, 02_02, 07_01, 07_02, 07_04, 07_05) 0.984 to 1.013, in the mean 1.000.  By how much the
# lowest point of a silhouette is nearer to the camera than the head: 0.11 and 0.07.
HEAD_IN_WALK: Final = 0.998
FOOT_NEARER: Final = 0.09

# The verdict.
MOST_MRAD: Final = 15.0  # of the worst camera; the issue that asked for this calibration names it
LEAST_WIDTH_M: Final = 0.6  # of the walked area, across its longest direction; by hand
GOOD_DELAY_S: Final = 0.03  # standard error of a delay: a walk of 1 m/s goes 3 cm in it
GOOD_ERROR_M: Final = 0.03  # expected in the walked area; by hand
STATURE_SHARE: Final = 0.01  # uncertainty of the scale with an exact stature: the spread of the two constants above
STATURES_M: Final = (1.0, 2.3)
