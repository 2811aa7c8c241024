"""Behavioural constants of the tracker: value, unit, meaning, provenance.

Values without a source were chosen by hand and checked with `python -m benchmarks clips`; those marked with a section
or equation are the paper's.  Array layouts and pure mathematics stay in their modules, statistics of body sizes in
`body/sizes.py` and `body/average_body.py`.

Compiled functions take these values in when they are compiled; `zenocap.common.jit` has them compiled again after a change.
"""

# Step: frame sets and messages.
MIN_VIEWS = 2  # views of a frame set that is tracked; fewer give no visual hull
MAX_QUEUED_FRAME_SETS = 2  # waiting for a Tick, against jitter; then the oldest is dropped
BEHIND_FRAME_SETS = 60  # without a drop, until a second one waits again: a tracker 2 % too slow drops one of 50
MISSING_FRAMES = 2  # frame sets without a viewer after which health names it
POINTS_PERIOD_NS = 100_000_000  # between published scene points, which are for display only
CAMERA_TOLERANCE = 1e-6  # relative: calibrations that differ by less are the same
MAX_SPREAD = 100.0  # rad and m; the greatest that TrackerPose allows

# Visual hull.  [Hybrid III]
TANGENT_REACH_PX = 4  # along the contour to either side, for a point's tangent
MIN_CONTOUR_PX = 4 * TANGENT_REACH_PX  # length of the shortest contour that is sampled
UNDISTORTION_ITERATIONS, UNDISTORTION_TOLERANCE = 40, 1e-10  # fixed point; |dx| + |dy| in normalized coordinates
MIN_DEPTH_M, MAX_DEPTH_M = 0.1, 50.0  # of points in front of a camera
RAY_STEP_PX = 2.0  # between samples of a viewing line; dilated silhouettes are hardly ever thinner
MAX_RAY_STEPS = 4000
BISECTIONS = 3  # of a step, to locate the ends of an interval
MIN_INTERVAL_RATIO = 1 / 3  # of the longest interval on the line; shorter ones are ignored
DISTANCE_MAP_PX = 96  # longest side of a silhouette in its distance map
DISTANCE_MAP_MARGIN_PX = 24  # around it; farther off, the distance to the map's edge is added
AXIS_SAMPLES = (0.5, 0.95)  # fractions of every part's axis at which the distance to silhouettes is taken

# View consistency.
CHECK_PERIOD_FRAMES = 5
LINES_PER_VIEW = 16  # contour rays of each view in a check
LAG_TEST_LINES = 32  # contour rays in a test of lags, of all views together
MAX_LAG_FRAMES = 5  # either way
VIEW_MARGIN = 0.15  # fraction of the image's width and height; a person farther inside is wholly or nearly in view
CHECK_MEMORY = 24  # checks or tests over which figures are averaged
MIN_CHECKS = 12  # before an average is used
MIN_LAG_TESTS = 12  # before a view's lag is judged
LAG_TEST_PERIOD = 12  # checks between two tests of lags once CHECK_MEMORY tests are done
PERSISTENT_CHECKS = 6  # in a row, before a view is reported as empty
MAX_SUSPECTS = 2  # views whose lags are tested in turn; with more, no single view is at fault
CALIBRATION_UNSUPPORTED = 0.10  # unsupported fraction of a view's contour from which its calibration may be wrong,
CALIBRATION_RATIO = 3.0  # and at least so many times that of the other views without it
SUSPECT_RATIO, SUSPECT_MARGIN = 1.5, 0.01  # a suspect leaves less than this ratio of the least fraction, plus the margin
LAG_TEST_UNSUPPORTED = 0.05  # unsupported fraction of a view's contour from which lags are tested,
LAG_TEST_DIFFERENCE = 0.02  # and difference of that fraction between views left out
LAG_GAIN = 0.03  # fraction of all contours that must gain support at the lag,
LAG_EXPLAINED = 0.8  # and at least this fraction of the contours without support because of the view,
LAG_HYSTERESIS = 0.6  # times this while the view is already reported
DISAGREEMENT_UNSUPPORTED = (
    0.40  # unsupported fraction of all contours from which disagreement without a culprit is reported
)
# A frozen view: fraction of the pixels of its crop that may differ, and of the others' silhouettes that changes meanwhile;
# for how long, and repeats of its picture: a camera of half the rate, or a quarter, is none.  Chosen by hand.
FROZEN_CHANGE, MOVING_CHANGE = 0.0005, 0.01
FROZEN_NS, FROZEN_REPEATS = 250_000_000, 4

# Localization and T-pose.
COLUMN_RADIUS_M = 0.3
COLUMN_LAYER_M = 0.1  # height of the layers in which a column is compared
COLUMN_LAYER_SATURATION = 2.0  # weight of a layer beyond which more of it does not make the column a person
INTERVAL_SCALE_M = 0.1  # length of a surviving interval whose midpoint is half as reliable as that of a short one
COLUMN_CANDIDATES = 200
MIN_COLUMN_RAYS = 40
GROUND_TOLERANCE_M = 0.05  # below the ground; anything lower may be clutter
COLUMN_MARGIN_M = 0.15  # above and below the column
MIN_STATURE_M, MAX_STATURE_M = 0.8, 2.4
PERSON_RADIUS = 0.65  # statures from the middle; no part of the person is farther
ARM_START = 0.18  # statures from the middle; only arms are farther,
ARM_HEIGHT = (0.62, 0.95)  # statures above the ground,
ARM_HALF_WIDTH = 0.09  # statures beside the line along both arms
# Statures, fingertip to fingertip.  Simulated people in the T-pose, two cameras at 160 x 120: 0.62 to 1.04; crouching with
# the arms spread: 1.14 and more.
MIN_ARM_SPAN, MAX_ARM_SPAN = 0.65, 1.10
ARM_SLOT, ARM_MAX_GAPS = 0.06, 2  # statures: length of the pieces of an arm; pieces in a row that may be empty
ARM_DIRECTIONS = 36  # candidate directions of the arms, over half a turn
T_POSE_FRAMES = 4  # frame sets from which the body is measured
T_POSE_STILL_M, T_POSE_STILL_COSINE = 0.05, 0.985  # m and cosine: greatest motion, change of height, and turn between them
T_POSE_DEVIATION = 0.25  # rad: standard deviation of joint coordinates about the T-pose
# Greatest root mean square angle of the eight parts of arms and legs from their directions in the T-pose, median of the
# frame sets: in the middle between simulated people in the T-pose, at most 15 (128 fits, also made at 160x120 with noise),
# and 13 who bend or reach, with trunk or back taken for arms or front, at least 19 (105 fits, seeds 551 to 599).  Tried
# afterwards: at most 16 of rendered people, 13 in the real film.
T_POSE_MAX_DEG = 17.0
T_POSE_HEADINGS = 24  # of an average body, tried for the direction of the arms; an even number
T_POSE_HOLD = (0.3, 0.2, 0.25)  # m, rad, rad: standard deviations about the T-pose
T_POSE_ITERATIONS, T_POSE_PASSES = 6, 2  # of a refinement; refinements of the fitted body's pose
T_POSE_RETRY_FRAMES = 5  # after an attempt that failed
GOOD_GAP_M = 0.015  # root mean square gap of a body in a scene without clutter
CLUTTER_TRUST_POWER = 2.0  # the reliability of a scene falls with this power of the gap
CLUTTER_DISTANCE_M = 0.10  # from the fitted body; rays farther off are clutter
MAX_GAP_M = 0.03  # root mean square gap of an accepted body, or the size of a pixel
RETRY_FRAMES = 15  # after an attempt that failed
START_AFTER_NS = 1_200_000_000  # in view without a T-pose, after which a track starts with an average body
START_RETRY_NS = 300_000_000  # between two attempts
# Support and misfit of the average body, from which a track starts.  Six simulated people who stand, walk, run and box, and
# twelve in the T-pose, in two to four views: at least 0.57, at most 0.0029.  Furniture: at most 0.69, at least 0.0027, but
# a pillar of a person's height and width has 0.86 and 0.0009.
START_SUPPORT, START_MISFIT_M2 = 0.55, 0.003
# A person on the floor fits like a box or a ball of that size: nothing that has not moved starts, nor anything compact.
FLOOR_HEIGHT = 0.78  # statures: nothing taller is sought on the floor
FLOOR_LOW_M = 0.3  # above the ground, of the lowest point: nothing that floats lies, as silhouettes without legs do
FLOOR_SPAN_M = 0.72  # nothing is that is smaller in all directions; people of 1.5 m who crouch have 0.8
FLOOR_STATURES_M = (1.58, 1.77)  # of the average bodies tried
FLOOR_RADIUS_M = 1.2  # about the column, within which a person on the floor is
FLOOR_MOTION_M = 0.02  # of the middle, from one half of START_AFTER_NS to the other
FLOOR_POSTURES, FLOOR_KEPT, FLOOR_PASSES = 4, 4, 3  # of the column's height; as SEARCH_KEPT, SEARCH_PASSES
START_STATURE_PERCENTILE = 90  # of the heights meanwhile, which a person who bends or jumps has not always

# Body fitting and online shape estimation.
FIT_ITERATIONS = 20
FIT_RESIDUAL_SCALE_M, FIT_RESIDUAL_LIMIT_M = 0.01, 0.20  # gap beyond which the gradient is constant; and is zero
FIT_GAP_TRUNCATION_M = 0.05  # in the reported root mean square gap
FIT_INDEPENDENT_RAYS = 300.0  # independent rays per scene: errors of the shape are correlated along the surface
SIZE_LIMIT = 4.0  # spreads over people of `body/sizes.py`: no size is farther from that of an average body
START_SHORT = 4.0  # spreads, shortness of the arms below the average at the start of a fit
FIT_TOLERANCE = 1e-3  # change of a logarithm, metre or radian below which the fit has converged
FIT_MAX_STEP = 0.3  # of a logarithm, metre or radian
NEW_POSTURE_ANGLE = 0.35  # rad: at least one coordinate differs so much from every posture used before
MAX_POSTURES = 60
POSTURE_INDEPENDENT_RAYS = 60.0  # independent rays per posture: errors of the shape repeat
POSTURE_DEVIATION = (0.05, 0.1, 0.3)  # m, rad, rad: of position, orientation and coordinates about the estimate
SHAPE_CHANGE = 0.004  # of a size's logarithm, from which the body in use is replaced
SHAPE_PAUSE_NS = 500_000_000  # after a jump of the pose, in which the shape is not estimated
SHAPE_SUPPORT_RATIO = 0.9  # of the expected support; less is not used to estimate the shape

# Correspondences and refinement.  [Hybrid V-B]
CONTACT_SHIFT_M = 0.15  # of the contact along an axis that points along the normal
LATERAL_SCALE_M = 0.03  # a ray that passes so far beside its contact has half the weight
OUTSIDE_WEIGHT = 1.0  # of a sample of the body outside of a silhouette, relative to a contour ray
ON_BODY_M = 0.04  # distance of a ray that is on the body
RESIDUAL_SCALE_M, RESIDUAL_LIMIT_M = 0.01, 0.15  # gap beyond which the gradient is constant; and is zero
CONVERGED_STEP = 0.01  # m and rad: the refinement ends with such a step
FORCE_MOMENTUM = 0.85  # fraction of a motion that is kept from one step to the next
NORMAL_MODULATION = 0.5  # epsilon of md = 1 - epsilon cos, 0 < epsilon < 1  [Hybrid V-B]; value by hand
FORCE_TRUNCATION_M = 0.10  # of rho in [Hybrid Eq. 32]; the paper gives no value
FORCE_GAIN = 8.0  # lambda, 1 / m: of the mean force on a group, m^2  [Hybrid Eq. 34, 38]; the paper gives no value
MOMENT_GAIN = 60.0  # rho, rad / m^3: of the mean moment on a group  [Hybrid Eq. 35, 39-40]; the paper gives no value
LINEAR_FORCE_GAIN = 0.5  # lambda: of the mean linear force on a group, m; the paper gives no value
LINEAR_MOMENT_GAIN = 4.0  # rho, rad / m^2: of the mean moment of linear forces on a group; the paper gives no value

# Particle filter.  [Hybrid V-A]
PARTICLE_RAY_STRIDE = 2  # particles are refined on every second ray, the estimate on all
INDEPENDENT_RAYS = 100.0  # independent rays per scene: errors of neighbours on a contour are correlated
LIKELIHOOD_INFORMATION = 30.0 / (2.0 * 0.01**2)  # 1 / m^2: 1 / sigma^2 of [Hybrid Eq. 29]; fewer rays, for body errors
PARTICLE_HOLD = (0.10, 0.20, 0.40)  # m, rad, rad: standard deviations of a refinement about its starting pose
ESTIMATE_HOLD = (0.05, 0.10, 0.20)  # m, rad, rad: the same of the estimate about the predicted pose
ESTIMATE_ITERATIONS = 2
PREDICTION_DEVIATION = (0.10, 0.30)  # m, rad: of particles about the predicted pose
TURN_RATE = 0.2  # per frame, of the running mean of the root's turn; chosen on people 620 to 631 who turn
TURN_DAMPING = 0.8  # fraction of that turn that is kept; chosen on the same
VELOCITY_DAMPING = 0.2  # fraction of the other velocities that is kept; chosen by `python -m benchmarks variants`
DYNAMIC_NOISE = (0.02, 0.05, 0.10)  # m, rad, rad: standard deviations of dynamic proposals per frame
PRIOR_FRACTION, MIN_PRIOR_FRACTION, MAX_PRIOR_FRACTION = 0.5, 0.2, 0.8  # of the proposals; the first at the start
PRIOR_FRACTION_RATE = 0.05  # per frame, towards the weight of the particles proposed by the prior
MIN_PRIOR_DISTANCE = 1e-3  # rad
SUPPORT_RATE = 0.03  # per frame, of the expected support and the expected distance from the prior
INITIAL_SUPPORT = 0.5  # expected fraction of a scene on the body, before it is observed
LOST_SUPPORT_RATIO = 0.6  # of the expected support, below which a frame counts as misfit
LOST_MISFIT_RATIO = 0.5  # of the greatest misfit, above which a frame counts as misfit
LOST_FRAMES = 6  # misfits in a row after which the track is lost
LOST_EMPTY_FRAMES = 60  # frames in a row without a person after which the track is lost
MIN_TRACKING_RAYS = 60  # of a scene in which a person can be seen

# Search of single limbs.
LIMB_DIRECTIONS, LIMB_TWISTS = 80, 8  # directions over the sphere; planes of a bent elbow or knee
LIMB_BENDS = {"elbow": (0.1, 0.9, 1.7, 2.4), "knee": (-0.1, -0.8, -1.6)}  # rad
LIMB_MAX_SWING = {"shoulder": 2.4, "hip": 1.7}  # rad from the middle of the range
LIMB_MAX_TWIST = {"shoulder": 3.15, "hip": 0.8}  # rad about the part
LIMB_TRIALS = 200  # placements of one limb tried in a frame, drawn at random
UNEXPLAINED_M = 0.02  # distance from the other parts beyond which a ray may belong to the limb
LIMB_SUPPORT_RATIO = 0.5  # of a limb's usual support, below which it is searched
LIMB_BODY_SUPPORT_RATIO = 0.75  # of the expected support of the body, below which no single limb is at fault
LIMB_MISFIT_RATIO = 0.9  # of the best particle's misfit, below which the searched limb becomes a particle
LIMB_SUPPORT_DECAY = 0.002  # per frame, of a limb's usual support
MAX_SPEED, MAX_TURN_RATE = 12.0, 25.0  # m/s and rad/s; a faster change of the estimate was no motion

# Confidence, see `filter/confidence.py`.  Coefficients fitted to simulated people until commit
# eb05fad, by the program of that commit: a limb is right whose joints are within 0.15 m; `python -m benchmarks confidence`
# checks them on others.
ARM_CONFIDENCE = (-2.02, 1.64, -0.06, 1.57, -11.46)  # of FEATURES, in the logarithm of the odds
LEG_CONFIDENCE = (-4.47, 2.17, -0.28, 2.74, -14.01)
HEADING_CONFIDENCE = (-0.52, 159.0)  # of a constant, and of the feet's reach forward (statures)
AMBIGUITY_SCALE = 0.2  # relative excess of the misfit at which the weight of another pose is 1 / e
LIMB_FEATURES_RATE = 0.3  # per frame, of the running mean of the features
LOST_LIMB = 0.5  # confidence below which a limb is reported as lost

# Rivals of the estimate, see `filter/rivals.py`.  All are chosen by hand, to be measured.
RIVAL_MOST = 4.0  # nats, bound of the log odds
RIVAL_SWITCH = 2.0  # nats, log odds beyond which a rival and the estimate are exchanged
RIVAL_SPEED = 10.0  # nats/s, most that frame sets change while a rival fits: those of one step are alike
RIVAL_ALIKE = 0.2  # ln of the ratio of misfits that proves nothing: a true pose has up to that more, by an average body
RIVAL_MET = 0.5  # of the log odds of legs that is left after legs have met
RIVAL_FITS = 2.0  # of the estimate's misfit, up to which a pose becomes a rival, and a refuted one stays
RIVAL_APART_M = 0.08  # distance of a leg from the estimate's, beyond which a pose is another one
RIVAL_TURN_DEG = 30.0  # from the estimate's heading, the same for rivals of the heading
RIVAL_DOUBT = 1.0  # nats against all rivals of the heading, below which it is no longer known
RIVAL_PASSES = 2  # as SEARCH_PASSES
RIVAL_FRESH_M = 0.10  # motion since the last frame set with which a scene is new evidence; a held pose is new once a second
LEG_TURN_RATE = 10.0  # rad/s, of a joint of a leg: a faster one counts against legs; knees of a walk turn at 6
STANDING_SPEED = 0.5  # m/s, of the ankle of a foot that stands, with the noise of two small views
STANDING_DEVIATION_M = 0.03  # of the height of a standing foot's ankle
STANDING_MOST = 4.0  # nats, against standing feet at different heights: there are steps
REACH_MOST = 0.03  # statures, reach of the feet beyond which they are not more probable: they are in other places
REACH_NATS = 80.0  # nats per stature that the feet reach farther forward; half of HEADING_CONFIDENCE's, which has one pose
MIRROR_VIEWS_DEG = (65.0, 115.0)  # angle of two views that show a trunk and the mirrored one with equal widths
MIRROR_MET = 2.5  # nats against a mirrored heading after it has met the estimate's: the heading is known, but not for long
MIRROR_TURNS_DEG = (40.0, 140.0)  # between both headings; smaller turns are no rivals, greater ones are the opposite one

# Relocalization and heading.
RELOCALIZE_AFTER = (1, 3)  # misfits in a row after which the whole scene is searched
SEARCH_HEADINGS = 8
SEARCH_RESIDUAL_LIMIT_M = 0.30  # of the first refinement
SEARCH_FIRST_ITERATIONS, SEARCH_ITERATIONS = 4, 4  # of the first refinement; of every pass
SEARCH_KEPT, SEARCH_PASSES = 12, 5  # candidates refined further; passes, each held near the end of the one before
FOUND_SUPPORT_RATIO = 0.8  # of the expected support, from which a person is found
EXPECTED_SUPPORT_DECAY, MIN_EXPECTED_SUPPORT = 0.9, 0.25  # after every search without success; lower bound
OTHER_POSTURES_PERIOD = 3  # frames from one search of other postures near the tracked one to the next; of rivals too
SURE_PERIOD = 6  # frames, the same while the heading is known and the limbs are sure; to be measured
SURE_LIMB = 0.75  # confidence from which a limb is sure
OTHER_POSTURES_TURNS = (-60.0, -30.0, 0.0, 30.0, 60.0)  # degrees from the tracked heading, at which they start
OTHER_POSTURES_KEPT, OTHER_POSTURES_PASSES = 6, 3  # as SEARCH_KEPT, SEARCH_PASSES
OTHER_POSTURES_PENALTY = 1.2  # relative increase of the misfit of one with the opposite heading, less for smaller turns
OTHER_POSTURES_RATIO = 0.95  # of the tracked pose's misfit, below which one of them replaces it
REPLACE_MISFIT_RATIO = 0.75  # of the tracked pose's misfit, below which another pose replaces it
FOOT_RADIUS, FOOT_HEIGHT = 0.16, 0.035  # statures: about an ankle and above the sole, where the points of a foot are
SHANK, SHANK_RADIUS = (0.25, 0.8), 0.09  # of its length from the ankle up, and statures about it: its points
UPRIGHT_SHANK = 0.5  # cosine of the greatest angle of a shank from the vertical, with which its foot shows the heading
MIN_FOOT_RAYS = 3  # of a foot, and of a shank
TOES_START = 0.02  # statures, at the start of a track, until the feet have been seen
TOES_RATE = 0.1  # per frame, of the running mean of the feet's reach
HEADING_TOES = 0.020  # statures, reach of the feet before the ankles from which the heading is known
HEADING_PENALTY = 0.3  # relative increase of the misfit of a pose with the opposite heading
DECIDED_HEADING_DEG, DECIDED_FRONT_DEG = 60.0, 90.0  # most that a start is turned from the user's decision; by hand
DECIDED_NS = 5_000_000_000  # after the user's decision on front and back, without rivals of the heading; by hand
HEADING_MEMORY_NS = 2_000_000_000  # after track loss, for which the last heading is preferred

# Both directions, offline.  Tuned with 24 and 12 takes of simulated people with motion capture in two and four views
# (`python -m benchmarks jitter`); the joint error hardly depends on them.
FUSION_INFORMATION = LIKELIHOOD_INFORMATION / 5.0  # 1 / m^2: of the misfit of a frame; those of successive frames are alike
FUSION_DOUBT = 1.0  # weight of the logarithms of the probabilities that limbs and heading are right; by hand
FUSION_DEVIATION = (0.05, 0.20, 0.30)  # m, rad, rad: of position, orientation and coordinates from one frame to the next
FUSION_SWITCH = 0.5  # ln of the ratio of likelihoods that a change of the direction costs, for each section of the body
FUSION_BLEND_S = 0.10  # duration of the change from the pose of one direction to that of the other,
FUSION_ALIKE = (0.10, 0.60, 0.60)  # m, rad, rad: where position, orientation and coordinates differ by less; by hand

# Motion prior.  [Hybrid IV]
PRIOR_CLAMP = 2.5  # standard deviations from a region's centre within its subspace; the paper does not clamp
PRIOR_CENTRE_WEIGHT = 0.05  # of the squared distance to the centre in [Hybrid Eq. 9]; the paper has none
PRIOR_DEVIATION_FLOOR_DEG = 2.0  # of every coordinate
RATE_TOLERANCE = 2e-3  # relative: steps between frame rates that are nearly whole are whole
MAX_NEGATIVE_TRANSITION = 0.02  # of a row's probability in a root of the transitions; beyond, no chain has that root
EM_MAX_ITERATIONS = 40
EM_TOLERANCE = 2e-3  # relative change of the mean reconstruction error
K_MEANS_ITERATIONS = 20
REGION_CANDIDATES = (5, 10, 15, 20, 30, 40, 60, 80)  # 20 in the paper  [Hybrid Fig. 4]
REGION_TOLERANCE = 0.05  # of the best held-out error, accepted for fewer regions
MIN_FRAMES_PER_REGION = 5  # the paper: 100 frames for 20 regions
ERROR_PERCENTILES = (50, 90, 99)  # of held-out distances from the prior
HELD_OUT_EVERY, HELD_OUT_STRETCH_S = 5, 1.0  # one stretch in so many is held out; its length
