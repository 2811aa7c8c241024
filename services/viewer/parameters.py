"""Behavioural constants of the viewer: value, unit, provenance.

Provenance: a section of [Two-view], "measured" or "clips" (tried out on the shared clips walk2, bend2 and kick2, which are
therefore no independent test), "anthropometry", or "chosen by hand".  Silhouette extraction has its own constants at the
top of the modules of `zenocap.common.vision`.
"""

from math import cos, radians

# Background and preview
# Pixels of the images that are kept at a time while it is learnt, 0.8 GB: 873 at 640x480, 129 at 1920x1080; chosen by hand
LEARNT_PX = 1 << 28
HALO_ROWS = 240  # of the image, below which a block of the compression is as large as a limb; in larger ones other things
# beside a person are taken for its noise: worse on a recording with a second one (`python -m benchmarks real-video`)
UPDATE_EVERY = 8  # frames between two updates of the background model; light changes slowly; chosen by hand
UPDATE_RATE = 0.01  # share of the difference that one update takes over; chosen by hand
UPDATE_MARGIN_ROWS = 40  # image rows per px of widening of the person before an update; chosen by hand
UPDATE_MARGIN_MIN_PX = 2  # px; chosen by hand
PREVIEW_NS = 200_000_000  # ns between two previews, at most 5 per second; chosen by hand
PREVIEW_PX = 320  # px, largest side of a preview; chosen by hand
PREVIEW_JPEG_QUALITY = 70  # of 100; chosen by hand

# The network that finds people, `people = true`
PEOPLE_PERIOD_NS = 300_000_000  # ns between two questions, at least; chosen by hand
PEOPLE_MARGIN = 0.2  # of the person's longer side, added on each side of the crop; chosen by hand
MIXTURE_NOISE = 2.0  # grey levels of noise where the background is mog2, which has no noise of its own; chosen by hand
PEOPLE_SMALLEST_PX = 48  # px, smallest side of a crop; chosen by hand

# Advice about the camera's images.  "Rooms": chosen on `python -m benchmarks advice`, seeds 40 to 47.
ADVICE_SAMPLE_S = 0.5  # s between two images that are measured; chosen by hand
ADVICE_REPORT_S = 1.0  # s between two messages; chosen by hand
ADVICE_WINDOW_S = 5.0  # s over which the person is measured; chosen by hand
ADVICE_LIGHT_S = 10.0  # s over which light and colour are compared, on the page of set-up too; chosen by hand
ADVICE_FLICKER_S = 6.4  # s of images for the flicker; each half is a little more than its measure needs
ADVICE_PX = 80  # px, width of the reduced image on which light and colours are measured; chosen by hand
ADVICE_CELLS = (8, 6)  # cells across and down whose brightness is followed; chosen by hand
ADVICE_PERSON_PX = 64  # px, height of the reduced person that is measured; chosen by hand
ADVICE_FOCUS_S = 10.0  # s between two measures of the focus on the room; chosen by hand
ADVICE_SAMPLES = 6  # images with a person, before anything is stated about the person; chosen by hand
ADVICE_ROWS = 48  # rows of the person whose edges are measured; chosen by hand
# Levels, that CONTRAST_QUANTILE of a third of the person differs from the room: 20 by rooms, 16 after seeds 100 and 101.
LOW_CONTRAST = 16.0
CONTRAST_QUANTILE = 0.3  # of the pixels of the third, darkest difference first; chosen by hand
# Holes: "sizes" is chosen on 2304 silhouettes of seeds 50 to 55, 45 to 180 px high (docs/measured.md of f0def349).
MANY_HOLES = 2.5  # %, of the silhouette, missing area that is found; sizes
CLOSING = 0.1  # of the person's height, width of the gaps in which it is looked for; sizes
ROOM_SIGMAS = 3.0  # sigmas of the noise, within which a gap shows the room; sizes
PARTLY_COVERED = 0.5  # of the difference of the next pixel, below which an edge is partly covered; chosen by hand
OTHER_COLOUR = 0.5  # of a squared difference, the part of another colour from which it is no such edge; chosen by hand
FLOOR_SHARE = 0.3  # of the height from the soles, where a shadow is between the feet; as in `common.vision.mask_refinement`
OFTEN_MIRRORED = 50.0  # %, of the images with a person, whose silhouettes contain a mirror image; chosen by hand
# "Floors": chosen on seeds 50 to 55 on floors that mirror 35 and 50 %, and on 44 people of the demo without a mirror image.
GLOSS_LIKENESS = 0.5  # overlap of the legs and their mirror image; rooms
GLOSS_CONTRAST = 0.6  # of the contrast of the legs, that of their mirror image at most; floors
GLOSS_COLOUR = 0.5  # cosine of the differences from the room of the legs and of their mirror image, at least; floors
GLOSS_PATTERN = 0.2  # correlation of both over the pixels, at least; floors
GLOSS_REACH = 0.33  # of the height of the silhouette, rows above and below the feet that are compared; chosen by hand
# Of the height of the silhouette from the top, where mirrored feet are: a mirror image is not taller than the person.
GLOSS_FEET = (0.5, 0.66)
SOME_OCCUPIED = 1.0  # %, of the images of the empty scene: one in 60 counts; chosen by hand
OFTEN_PEOPLE, OFTEN_UNCOVERED = 30.0, 30.0  # %, of the images with a person; chosen by hand
OTHERS_PX = 160  # px, longer side of the reduced image in which other people are looked for; chosen by hand
OTHERS_SIGMAS = 6.0  # sigmas of the noise, beyond which a pixel belongs to another thing; chosen by hand
OTHERS_HEIGHT, OTHERS_AREA = 0.5, 0.25  # of the person's, for another person; chosen by hand
CLEARLY_LEFT = 0.25  # of the outline of a place that a person has left, edges of the room alone; chosen by hand
OFTEN_CUT = 40.0  # %, of the images with a person; chosen by hand
SMALL_PERSON = 40.0  # px, height: the people of the demo in 160x120, whom two-view tracks, have 46; chosen by hand
SMALL_TRACKED = 100.0  # px, the same where only the tracker uses the silhouettes; by hand
CONTACT_PX = 3  # px of a silhouette along the border of the image, from which it is cut off; chosen by hand
HIGH_DRIFT = 5.0  # %, change of the brightness over ADVICE_LIGHT_S; rooms
HIGH_COLOUR_DRIFT = 3.0  # %, change of the ratio of two colours; rooms
HIGH_FLICKER = 1.5  # %, standard deviation; chosen by hand
LOW_BRIGHTNESS = 45.0  # levels, mean; chosen by hand
MUCH_SATURATED = 5.0  # %, of the pixels; chosen by hand
WIDE_EDGES = 0.01  # of the image height, width of its sharpest edges; rooms
WIDE_EDGES_MIN_PX = 3.5  # px, the same at least; rooms
SHARPEST = 0.2  # quantile of the widths of the edges of the room; chosen by hand
EDGE_LEVELS = 30.0  # levels, across an edge whose width is measured; chosen by hand
EDGE_REACH_ROWS = 20  # image rows per px on both sides of such an edge; chosen by hand
MOVING_SHARE = 0.015  # of the person's height per frame, from which a contour moves; chosen by hand
JUMP_SHARE = 0.15  # of the person's height per frame, from which it is another contour; chosen by hand
MOVING_ROWS = 40  # moving edges, before motion blur is stated; chosen by hand
LONG_BLUR = 1.0  # %, of the person's height: 17 mm of an adult; rooms

# Feedback of the tracker
FEEDBACK_FRAMES = 4  # frames after a pose in which its prediction is used; chosen by hand
FEEDBACK_GAP_NS = 200_000_000  # ns between two poses from which a motion is measured, at most; chosen by hand

# Facade and flank, silhouette features  [Two-view 3.1]
UPPER_BODY_COLUMN = 0.65  # torso heights, smallest column of the upper body; paper 3.1: 1.0; measured: 0.6 to 0.7 is robust
BELOW_HIPS = 0.2  # torso heights below the navel: y_hip = y_c + 0.2 h; paper 3.1
FOOT_BAND = 0.03  # of the body height from the soles; chosen by hand
SHIN_BAND = (0.06, 0.11)  # of the body height from the soles; chosen by hand

# Body definition: bands of the body height from the soles, in which parts are measured  [Two-view 2.4]; chosen by hand
TORSO_FRONT_BAND = (0.54, 0.74)  # between hips and horizontal arms
TORSO_SIDE_BAND = (0.52, 0.78)  # between hips and shoulders
HEAD_BAND = (0.86, 1.0)  # head and neck
THIGH_BAND = (0.32, 0.44)  # between crotch and knee
SHIN_WIDTH_BAND = (0.06, 0.26)  # between ankle and knee
# Body heights, distance of the lowest visible sole before the body: the ball of a foot seen from the front, the near
# foot seen from the side.  Anthropometry (Drillis and Contini): length of a foot 0.152, a quarter of it behind the ankle.
FRONT_TOES = 0.06
SIDE_TOES = 0.05
HEAD_REMOVAL_WIDTH = 0.8  # torso widths, length of the structuring element that removes the head; paper 2.4, Fig. 6
SHORTEST_HEAD = 0.05  # body heights between the top of the head and the shoulder line; chosen by hand
SHORTEST_ARM = 0.2  # body heights of a stretched arm beside the torso (about 0.37 on people); chosen by hand
UNEVEN_ARMS = 0.10  # body heights, greatest difference of the arms' reach; chosen by hand
FINE_STEPS = (0.94, 0.97, 1.0, 1.03, 1.06)  # factors tried for each fine-tuned length; chosen by hand
FINE_TUNED = (
    "torso_width",
    "arm_thickness",
    "arm_span",
)  # lengths that the matching score fine-tunes, in order; chosen by hand
PAPER_FINE_TUNED = ("torso_width", "arm_thickness", "arm_angle", "arm")  # in this order; paper 2.4
ANGLE_STEPS = tuple(radians(step) for step in (-8, -4, 0, 4, 8))  # rad added to the angle of the arms; chosen by hand
HIDDEN_TORSO_DEPTH = 0.7  # torso widths, depth assumed while fine-tuning in the front view; chosen by hand

# Position and tilt of the torso  [Two-view 3.2]
SHIFTS_PX = (-5, -2, -1, 1, 2, 5)  # px; paper 3.2; 0, which the paper omits, is the current position
PAPER_ROWS = 120  # px, height of the image that SHIFTS_PX is for; paper
SHIFT_ROUNDS = 4  # of shifts along both axes per scale; chosen by hand
TILT_PIVOTS = (1.0, 0.0)  # torso lengths above the navel about which the torso tilts: neck, then navel; chosen by hand
TILT_REGION = radians(32)  # rad, first search region; as LEG_REGION; chosen by hand
TILT_STOP = radians(2)  # rad, width of the last search region; chosen by hand
LONGEST_LEG = 0.9999  # of the stretched length, at most; chosen by hand
STRAIGHT_KNEE_M = 0.01  # m, distance of the knee of a straight leg from the line hip to foot; chosen by hand
CROP_MARGIN = 0.35  # body heights around the silhouette in which the model is drawn; chosen by hand
CROP_MARGIN_MIN_PX = 8  # px; chosen by hand

# Limb search  [Two-view 3.3-3.5]
ARM_REGION = radians(64)  # rad, first search region of an arm; paper 3.5
LEG_REGION = radians(32)  # rad, first search region of a leg; paper 3.5
FREE_ELBOW = radians(140)  # rad, t_ha of an upper arm above LOW_UPPER_ARM; paper 3.3 (2)
ELBOW_OUTWARD = radians(140)  # rad, largest bend of the elbow away from the torso; paper 3.3 (2)
LOW_UPPER_ARM = radians(110)  # rad, theta_Z beyond which the torso limits the elbow; paper 3.3 (2)
SQUAT_FOLD = radians(50)  # rad, largest theta_X of the hip of a person who squats, in the facade; paper 3.4
STOP = radians(4)  # rad, width of the last search region; paper 3.5
MIN_FLEX_COS = cos(radians(150))  # cosine of the largest flexion of elbow and knee; anthropometry
BACKWARD_KNEE = -0.12  # sine of the largest backward bend of a knee that noise may show; chosen by hand
SWEEP_STEP = radians(15)  # rad between two trials for a lost limb; chosen by hand
RESTART_GAIN = 0.004  # matching score that a search from another start must gain; chosen by hand

# Lost limbs
LOST_PERSON = 0.5  # of the usual matching score: below, the person is searched at the torso of the silhouette; by hand
LOST_LIMBS = 0.92  # of the usual matching score: below, limbs are searched all around; clips
USUAL_SCORE_RISE = 0.2  # step of the usual score towards a better one, of their difference; chosen by hand
USUAL_SCORE_FALL = 0.01  # the same for a worse one; chosen by hand
UNPLACED_NS = 3_000_000_000  # ns without an assignment after which the tracked pose is dropped; chosen by hand

# Start of files and of the simulated person
EPOCH_LEAD_NS = 1_500_000_000  # ns from a proposal to the start it proposes; chosen by hand
EPOCH_REPEAT_NS = 400_000_000  # ns between two proposals; less than the lead, so that none expires; chosen by hand
EPOCH_SETTLE_NS = 300_000_000  # ns to wait for proposals in flight; chosen by hand
EPOCH_REPORT_NS = 3_000_000_000  # ns before the missing viewers are logged; chosen by hand
EPOCH_AHEAD_NS = 10_000_000_000  # ns by which a proposal may be ahead of this clock; chosen by hand
RUNS_ON_NS = 60_000_000_000  # ns by which a viewer may end after its film; chosen by hand
LONGEST_RUN_NS = 365 * 86_400_000_000_000  # ns that a viewer of a source without end may run; chosen by hand
ACTOR_PREROLL = 30  # frames of empty scene when the background does not define them; chosen by hand

# Sources
RECONNECT_FIRST_S = 0.5  # s before the first reconnection of a device, doubled each time; chosen by hand
RECONNECT_LONGEST_S = 10.0  # s, longest wait; chosen by hand
STREAM_TIMEOUT_MS = 5000  # ms to open or read a stream; chosen by hand
EARLY_FRAME = 0.25  # of a frame period, greatest lead of a frame that is still the next; chosen by hand
LATE_FRAMES = 1.0  # frames, delay of a live file from which frames are dropped; chosen by hand
LETTERBOX = 0.02  # relative size difference up to which an image counts as letterboxed; chosen by hand

# Kept backgrounds
KEEP_S = 60.0  # s between two writes of a kept background; chosen by hand
BACKGROUNDS = "backgrounds"  # folder of kept backgrounds, beside the rig file; by convention
