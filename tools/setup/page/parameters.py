"""Behavioural constants of the live page of the cameras, with unit and provenance.

"By hand" means chosen without a measurement.  The limits of the measures decide only when a line of advice is shown.
"""

from typing import Final

# Pictures on the page.
PICTURE_PERIOD_S: Final = 0.1  # between two pictures of a camera; by hand
TILE_PX, LARGE_PX = 640, 1920  # long side of a picture, and of an enlarged one; by hand
JPEG_QUALITY, LARGE_JPEG_QUALITY = 75, 88  # of a picture, and of an enlarged one; by hand
POLL_S: Final = 0.01  # between looks for new images; by hand
READY_S: Final = 10.0  # in which one camera has to give an image, else the command ends; by hand
RETRY_S: Final = 3.0  # before a camera that does not open is tried again; by hand
LATE_S: Final = 1.5  # without an image, from which a camera is called silent; by hand
FILE_DELAY_S: Final = 0.5  # before video files begin, so that all of them are open; by hand

# Measures.
MEASURE_PERIOD_S: Final = 0.5  # between two measures of a camera; by hand
KEPT_S: Final = 0.45  # of images that are kept of each camera: those around a view of the board, BURST_S, and a little

# Advice.
LOW_RATE: Final = 0.9  # of the requested rate; by hand
HIGH_JITTER: Final = 0.25  # of the frame period, 95 % of the intervals; by hand
SOFT: Final = 0.6  # focus measure by the best one seen; by hand
MUCH_BLACK: Final = 0.3  # share of pixels; by hand
BRIGHT_MEAN: Final = 205.0  # of 255; by hand
HIGH_NOISE: Final = 6.0  # standard deviation, levels; by hand

# Board.  Checked on simulated rooms at commit 4d52ed9, by the program of that commit.
BURST_PERIOD_S: Final = 1.0  # between stretches of images in which the board is searched; by hand
VARIANT_IMAGES: Final = 3  # with the board, that tell which variant of it is shown; by hand
WHY_PERIOD_S: Final = 12.0  # without any board, after which the reason is searched; by hand
MOVED_SHARE: Final = 0.03  # of the image width, by which the board has moved to count as another moment; by hand
MIN_MOMENTS: Final = 8  # different moments of two cameras that connect them; by hand
MIN_CAMERA_MOMENTS: Final = 15  # different moments of each camera; by hand
MIN_COVERAGE: Final = 0.45  # of the cells of an image; above GOOD_COVERAGE of the verdict
TILT_DEG: Final = 20.0  # between the board and the plane across the view, from which it is tilted; by hand
MIN_TILTED: Final = 2  # moments in each of MIN_SIDES of four sides to which the board is tilted; by hand
MIN_SIDES: Final = 2
NOMINAL_FOCAL: Final = 0.85  # of the image width, for the angle of the board before the lens is known; by hand
MAX_VIEWS: Final = 6000  # of a camera: 8 minutes; later ones replace the earliest; by hand

# Points in pictures.
STILL_PX: Final = 4096  # long side of the picture in which points are placed, at most; by hand
STILL_JPEG_QUALITY: Final = 95  # of that picture; by hand
MOST_POINTS: Final = 200  # of a scene; by hand
FINISH_HINT_S: Final = 10.0  # in which Finish is pressed again though changes are not saved; by hand
