"""Body definition of one view as printed, by shares of width and height.  [Two-view 2.4]"""

from collections.abc import Mapping
from math import atan2, pi

import numpy as np

from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.proportions import SHOULDER_DROP, body_from_paper_lengths, t_pose_angles
from zenocap.common.body.segments import limb_directions
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.two_view.body_definition import mean_arm_thickness, torso_columns, without_head
from zenocap.services.viewer.two_view.body_fit import BodyFit, body_model
from zenocap.services.viewer.two_view.paper.projection import orthographic


def front_measures(mask: Mask) -> tuple[dict[str, float], float]:
    """Lengths of the front view in px, PAPER_FRONT_LENGTHS by name, and theta_armz, radians from straight down.

    Raises ValueError when the posture is not the T-pose.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    torso = torso_columns(mask)
    highest, lowest = int(rows[0]), int(rows[-1]) + 1
    height = lowest - highest
    headless = without_head(mask, torso.width)
    shoulder_rows = np.flatnonzero(headless[: highest + height // 2].any(axis=1))
    if shoulder_rows.size == 0 or shoulder_rows[0] - highest < p.SHORTEST_HEAD * height:
        raise ValueError("no T-pose: no shoulder line below the head")
    head = float(shoulder_rows[0] - highest)
    shoulder_row = highest + head + SHOULDER_DROP * torso.width / 2  # y_a = y_c - len_torso + 0.45 LR_torso, y down
    arms, angles = [], []
    for side, column in ((-1, int(columns[0])), (1, int(columns[-1]))):
        hand_row = float(np.flatnonzero(mask[:, column]).mean())
        # Paper (corrected): 2.4 takes |y_b - y_a|, which does not tell a raised hand from a lowered one; here signed.
        across = abs(column + side * 0.5 - (torso.centre + side * torso.width / 2))
        arms.append(float(np.hypot(across, hand_row - shoulder_row)))
        angles.append(atan2(across, hand_row - shoulder_row))
    if min(arms) < p.SHORTEST_ARM * height:
        raise ValueError(f"no T-pose: an arm reaches {min(arms):.0f} px, at least {p.SHORTEST_ARM * height:.0f} expected")
    lengths = {
        "height": float(height),
        "head": head,
        "torso_width": float(torso.width),
        # Paper (open): Fig. 7 has one arm; here the mean length and the mean angle of both.
        "arm": float(np.mean(arms)),
        # Paper (open): the radius of the arms is named and not given.
        "arm_thickness": mean_arm_thickness(mask, torso, columns, round(p.SHORTEST_ARM * height)),
    }
    return lengths, float(np.mean(angles))


def side_measures(mask: Mask) -> dict[str, float]:
    """Lengths of the side view in px: height, and depth of the torso.  Raises ValueError for an empty mask."""
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        raise ValueError("the silhouette is empty: no person in view")
    return {"height": float(rows[-1] + 1 - rows[0]), "torso_depth": float(torso_columns(mask).width)}


def side_lengths(mask: Mask, metres_per_px: float) -> Mapping[str, float]:
    """PAPER_SIDE_LENGTHS, metres."""
    return {name: length * metres_per_px for name, length in side_measures(mask).items()}


def fine_tuned(
    anatomy: Anatomy, mask: Mask, camera: Floats, position: Floats, yaw_rotation: Floats, torso_share: float
) -> Mapping[str, float]:
    """PAPER_FRONT_LENGTHS after fine-tuning torso width, arm radius, arm angle and arm length, metres.

    mask: (height, width).  camera: (5, 3) level camera rows.  position: (3,) navel.  yaw_rotation: (3, 3) torso to world.
    torso_share: see `body_from_paper_lengths`.  Raises ValueError when the posture is not the T-pose.
    """
    # Paper (corrected): fine-tunes without bounds; Eq. 1 penalizes p twice as much as n, so the body would grow.
    depth = float(camera[2] @ position + camera[3, 2])
    measures, arm_angle = front_measures(mask)
    trial = {name: length * depth / float(camera[4, 0]) for name, length in measures.items()} | {"arm_angle": arm_angle}
    flat = orthographic(camera, depth)

    def score(lengths: Mapping[str, float]) -> float:
        depth = {"torso_depth": p.HIDDEN_TORSO_DEPTH * lengths["torso_width"]}
        bdp = body_from_paper_lengths(anatomy, {**lengths, **depth}, torso_share)
        angles = t_pose_angles(anatomy)
        angles[anatomy.index["right_shoulder.z"]] = pi - lengths["arm_angle"]
        angles[anatomy.index["left_shoulder.z"]] = pi + lengths["arm_angle"]
        directions = limb_directions(anatomy, angles)
        return BodyFit(body_model(anatomy, bdp), flat, mask).place(position, yaw_rotation, directions)

    for name in p.PAPER_FINE_TUNED:
        if name == "arm_angle":
            trials = [trial | {name: trial[name] + step} for step in p.ANGLE_STEPS]
        else:
            trials = [trial | {name: trial[name] * step} for step in p.FINE_STEPS]
        trial = max(trials, key=score)
    # Paper (replaced): 2.4 also gives theta_armz as the first angle of the arms; tracking starts from level arms.
    return {name: length for name, length in trial.items() if name != "arm_angle"}
