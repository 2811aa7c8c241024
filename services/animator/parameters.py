"""Behavioural constants of the animator, with unit and provenance.

"By hand" means chosen without a measurement.  Constants inside compiled functions stay beside them in `render/`.
The page has its own at the top of `page/static/*.js`.
"""

# Presence of services.
FRAME_TIMEOUT_NS = 1_000_000_000  # a viewer without frames for this long is stale; by hand
MAX_ENTRIES = 128  # viewers that are kept, which bounds the memory; by hand
TICK_NS = 200_000_000  # period at which the condition of services is evaluated; by hand

# Page.
VIEWS_PERIOD_NS = 60_000_000  # at least, between two updates of the silhouettes; by hand
POSE_WAIT_NS = 500_000_000  # after a pose, silhouettes wait this long for the next, so that both fit; by hand
SERVICES_PERIOD_NS = 250_000_000  # between two updates of the table of services; by hand
CHECKS_PERIOD_NS = 500_000_000  # between two updates of the set-up checks; by hand
BEST_POSTURES = 3  # posture models that are shown with their log-likelihoods; by hand
COMMANDS_SHOWN = 8  # latest command results that are sent together, so that a slow page misses none; by hand
RECORD_PERIOD_NS = 1_000_000_000  # between two commands of pages that start or stop the recording; as the integrator's

# Playing takes on the page.
MAX_TAKES = 200  # listed, newest first; by hand
MAX_PLAYER_COMMANDS = 64  # that wait for the player; further ones are dropped; by hand
PLAYER_PERIOD_NS = 200_000_000  # between two updates of the player's position; by hand
PLAYER_WAIT_S = 0.02  # longest wait for a message, so that commands are handled; by hand
REPLAY_TIMEOUT_S = 3.0  # for the replay process to end; by hand
REPLAY_DELAY_S = 0.3  # before the replay publishes, for discovery of the session; by hand
POSED_S = 0.5  # after a pose, the pictures of a take follow its poses and not the position of the player; by hand
MAX_OPENING_MESSAGES = 4000  # of a take, in which the first pose is searched while the replay starts: about 0.2 s; by hand
SHOW_POLL_S = 0.1  # period at which `zenocap show` checks whether to end; by hand

# Saving a take for other programs, and takes that are dropped on the page.
SAVING_NICENESS = 10  # of the process beside a live rig, which keeps its rates; by hand
SAVING_END_S = 5.0  # for the process to end; by hand
MAX_SAVED_LINES = 50  # of the output of the command that are kept; by hand
MAX_SAVED_NAMES = 1000  # walk.bvh, walk-2.bvh and so on; by hand
MAX_DROPPED_BYTES = 1_000_000_000  # of a take that is dropped on the page: an hour of eight views without previews; by hand
MAX_DROPPED_PIECE = 65_536  # bytes of one message of it; by hand
DROPPED_FREE_BYTES = 1_000_000_000  # that stay free where it is stored; by hand
DROPPED_PAUSE_S = 20.0  # longest pause between two messages of it; by hand
KEPT_DROPS = 2  # latest dropped takes that are kept, the shown one and the one before; by hand
MAX_FOREIGN_MESSAGES = 10_000  # of other programs before the first one of zenocap; by hand

# Set-up checks of a silhouette; all by hand.
MIN_PERSON_HEIGHT, MAX_PERSON_HEIGHT = 0.35, 0.97  # of the image height
MIN_PERSON_AREA = 0.004  # of the image area; below it there is no person
MAX_FRAYED = 0.12  # of the silhouette's area that is thinner than three pixels
MAX_HOLES = 0.02  # area of the holes, relative to the silhouette's
GOOD_SCORE = 0.5  # matching score [Two-view Eq. 1] above which the model fits

# Outputs.
MAX_FOXGLOVE_CLIENTS = 32  # connected at a time; by hand
MAX_HANDSHAKE_BYTES = 16_384  # of a request to the Foxglove output; by hand
MAX_DATAGRAM_BYTES = 1400  # below the Ethernet MTU of 1500 bytes, so that no datagram is fragmented
QUIET_DATAGRAMS = 300  # successful datagrams after which a new failure is logged again: 10 s at 30 poses/s; by hand
MAX_LSL_AGE_NS = 10_000_000_000  # older samples are of a replayed take and are stamped with the present; by hand
MAX_ROS_AGE_NS = 10_000_000_000  # as MAX_LSL_AGE_NS
ROS_LIFETIME_NS = 1_000_000_000  # of markers: the figure disappears when no pose follows; by hand, as in Foxglove
ROS_BONE_WIDTH_M, ROS_JOINT_DIAMETER_M = 0.03, 0.06  # of markers; by hand
ROS_TEXT_HEIGHT_M, ROS_TEXT_ABOVE_HEAD_M, MAX_ROS_TEXT = 0.12, 0.2, 64  # of the posture, letters; by hand

# Rendering; all by hand, by the look of the pictures.
FIELD_OF_VIEW_DEG = 26.0  # along the shorter side, so that the body is not distorted
FILL = 0.88  # part of the picture that the scene fills at most
MIN_DISTANCE_M = 2.5  # of the camera
BODY_MARGIN_M = 0.16  # of the body's surface around its joint centres
FOLLOW_SMOOTHING_S = 0.5  # standard deviation of the Gaussian that smooths the path of a following camera
LIT_RADIUS, MIN_LIT_RADIUS_M = 1.6, 3.2  # of the lit floor, relative to the extent of the scene, and at least
PICTURE_SAMPLES, FILM_SAMPLES = 4, 2  # along either side of a pixel, of a picture and of a film
MAX_DRAWING_THREADS = 4  # of a film; the encoder has its own
SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG = 48.0, 52.0  # to the left of the camera, and above the horizontal
SHADOW_TEXEL_M, SHADOW_MARGIN_M, PENUMBRA_M = 0.008, 0.12, 0.022  # of the shadow map; sigma of its soft edge
CONTACT_TEXEL_M, CONTACT_MARGIN_M = 0.02, 0.3  # of the map of body parts close to the floor
CONTACT_BLUR_M, CONTACT_HEIGHT_M = 0.055, 0.35  # sigma of its soft edge; parts above this height do not darken the floor
MAX_TEXELS = 2048  # along either side of a map
GRID_M = 1.0  # between bold lines of the floor; fine ones every quarter
TRAIL_RADIUS_M = 0.008  # at the newest end of a trail
TRAIL_SPACING_M = 0.01  # points of a trail nearer to each other are merged
CAPTION_HEIGHT_PX = 720  # picture height for which caption sizes are given
FONT_OVERSAMPLING = 3  # captions are drawn this much larger and reduced, because OpenCV's lines have whole widths

# Comparison of two takes
MAX_UNMATCHED_NS = 100_000_000  # between the times of compared poses, at most; of takes of 10 poses/s and more; by hand

# Pictures of the videos behind a take
MAX_SHOWN_POSTURES = 2000  # on the position of the player; chosen by hand
MAX_PICTURE_LEAD_S = 0.5  # greatest lead of requested pictures over the pose; by hand
PICTURES_PER_S = 25.0  # at most, of each camera while the take plays; chosen by hand
