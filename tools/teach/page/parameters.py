"""Behavioural constants of the page on which postures are taught, with unit and provenance.

"By hand" means chosen without a measurement.
"""

from typing import Final

# Poses that are sent to the page.
MAX_POSE_RATE: Final = 30.0  # poses/s; more are left out; by hand
CHUNK_S: Final = 20.0  # of poses in one update: about 120 kB; by hand
POSITION_SCALE: Final = 1000.0  # steps per metre: millimetres
QUATERNION_SCALE: Final = 32767.0  # steps per 1: 16-bit integers
CURVE_POINTS: Final = 4000  # at most, of the speed of a take; by hand
POLL_S: Final = 0.02  # between looks for commands; by hand

# Labels.
LEAST_LABEL_S: Final = 0.2  # 3 frames at the models' 15 frames/s; by hand
MOST_UNDONE: Final = 500  # changes that can be undone; by hand

# Live trial.
LIVE_WAIT_S: Final = 0.1  # longest wait for a pose, after which it is looked whether to end; by hand
LIVE_PERIOD_S: Final = 0.1  # between two updates of the page; by hand
LIVE_SILENT_S: Final = 3.0  # without poses, from which the page says so; by hand
LIVE_SHOWN: Final = 8  # latest postures; by hand

# Held-out result.
MOST_GROUPS: Final = 8  # of examples that are held out in turn, one training each; by hand
ENOUGH_EXAMPLES: Final = 3  # that are advised for each posture; by hand
