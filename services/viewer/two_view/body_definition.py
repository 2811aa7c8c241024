"""Body definition parameters of one view, measured in the T-pose.  [Two-view 2.4]

The person stands upright with both arms horizontal to the sides.  Lengths are measured in px of the level view, y down, and
returned in metres by the scale of the view at the person.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.proportions import body_from_lengths, t_pose_angles
from zenocap.common.body.segments import limb_directions
from zenocap.services.viewer import parameters as p
from zenocap.services.viewer.two_view.body_fit import BodyFit, body_model


@dataclass(frozen=True)
class Torso:
    """Columns [left, right) of the torso and the mean column height `avg`, px.  [Two-view Fig. 5]"""

    left: int
    right: int
    avg: float

    @property
    def width(self) -> int:
        return self.right - self.left

    @property
    def centre(self) -> float:
        return (self.left + self.right - 1) / 2


def vertical_projection(mask: Mask) -> Ints:
    """P(x): (width,) silhouette pixels of every column.  mask: (height, width)."""
    return np.asarray(np.count_nonzero(mask, axis=0), dtype=np.int64)


def torso_columns(mask: Mask) -> Torso:
    """Columns between the outermost ones with P(x) > avg, the mean column.  Raises ValueError for an empty mask."""
    projection = vertical_projection(mask)
    inside = np.flatnonzero(projection)
    if inside.size == 0:
        raise ValueError("the silhouette is empty: no person in view")
    avg = float(projection[inside[0] : inside[-1] + 1].mean())
    high = np.flatnonzero(projection > avg)
    if high.size == 0:  # all columns have the same height
        return Torso(int(inside[0]), int(inside[-1]) + 1, avg)
    return Torso(int(high[0]), int(high[-1]) + 1, avg)


def without_head(mask: Mask, torso_width: int) -> Mask:
    """Silhouette without head: closed and opened with an element of 0.8 W_torso x 1.  [Two-view Fig. 6]"""
    length = max(3, round(p.HEAD_REMOVAL_WIDTH * torso_width) | 1)  # odd: an even element shifts the mask
    element = np.ones((1, length), np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, element)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, element), dtype=np.uint8)


@dataclass(frozen=True)
class Scale:
    """Scale of a level view at the person.  depth: of the person, m.  focal, horizon: focal length and horizon row, px."""

    depth: float
    focal: float
    horizon: float

    @property
    def metres_per_px(self) -> float:
        """Size of a pixel at the depth of the person, metres."""
        return self.depth / self.focal

    def height(self, highest: int, lowest: int, toes: float) -> float:
        """Height in metres from row `highest` to the bottom of row `lowest`, which shows soles nearer by `toes` heights."""
        # Paper (replaced): 2.4 takes the rows; the toes are nearer than the body and lower in the image, 2 % of the height.
        above, below = self.horizon - (highest - 0.5), lowest + 0.5 - self.horizon
        nearer = toes * (above + below) * self.metres_per_px
        return (above * self.depth + below * (self.depth - nearer)) / self.focal


def front_lengths(mask: Mask, scale: Scale) -> Mapping[str, float]:
    """Parameters of the front view by name, metres.  Raises ValueError when the posture is not the T-pose.

    height, torso_width, arm_span, arm_thickness, head_width, thigh_width, leg_width.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    torso = torso_columns(mask)
    columns = np.flatnonzero(mask.any(axis=0))
    lowest, highest = int(rows[-1]), int(rows[0])
    height = lowest + 1 - highest
    headless = without_head(mask, torso.width)
    # Paper (replaced): 2.4 takes the head's length from y_h; here y_h only checks the T-pose, see `body_from_lengths`.
    shoulder_rows = np.flatnonzero(headless[: highest + height // 2].any(axis=1))
    if shoulder_rows.size == 0 or shoulder_rows[0] - highest < p.SHORTEST_HEAD * height:
        raise ValueError("no shoulder line below the head: no T-pose, or the arms cover the head")
    if abs((columns[0] + columns[-1]) / 2 - torso.centre) > p.UNEVEN_ARMS * height:
        raise ValueError("one arm reaches further than the other: hold the T-pose, facing this camera")
    m = scale.metres_per_px
    return {
        "height": scale.height(highest, lowest, p.FRONT_TOES),
        # Paper (replaced): 2.4 takes the columns above the mean, with shoulders or without, depending on the arms.
        "torso_width": _mean_width(mask, p.TORSO_FRONT_BAND) * m,
        # Paper (replaced): 2.4 takes length and angle of each arm from its extreme point; here half the span, horizontal.
        "arm_span": (columns[-1] + 1 - columns[0]) * m,
        # Paper (open): 2.4 gives no radius of the arm.
        "arm_thickness": mean_arm_thickness(mask, torso, columns, round(p.SHORTEST_ARM * height)) * m,
        # Paper (replaced): 2.4 sets the head radii to 0.2 W and 0.16 W; here both are measured.
        "head_width": _mean_width(mask, p.HEAD_BAND) * m,
        # Paper (corrected): the leg radii 0.2 W and 0.36 W of 2.4 seem swapped; here round legs of the measured width.
        "thigh_width": _mean_width(mask, p.THIGH_BAND) / 2 * m,
        "leg_width": _mean_width(mask, p.SHIN_WIDTH_BAND) / 2 * m,
    }


def side_lengths(mask: Mask, scale: Scale) -> Mapping[str, float]:
    """Parameters of the side view, metres: height, torso_depth, head_depth.  Raises ValueError without one."""
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        raise ValueError("the silhouette is empty: no person in view")
    return {
        "height": scale.height(int(rows[0]), int(rows[-1]), p.SIDE_TOES),
        # Paper (replaced): 2.4 takes the columns above the mean: those of the legs; chest and seat extend beyond them.
        "torso_depth": _mean_width(mask, p.TORSO_SIDE_BAND) * scale.metres_per_px,
        "head_depth": _mean_width(mask, p.HEAD_BAND) * scale.metres_per_px,
    }


def _mean_width(mask: Mask, band: tuple[float, float]) -> float:
    """Mean silhouette pixels per row in a band of the body height; band: shares of the height from the soles.

    Raises ValueError for a band without any.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    highest, lowest = int(rows[0]), int(rows[-1]) + 1
    first, last = (round(lowest - share * (lowest - highest)) for share in (band[1], band[0]))
    pixels = np.count_nonzero(mask[first : max(last, first + 1)])
    if not pixels:
        raise ValueError(f"the silhouette has a gap at {band[0]:.0%} to {band[1]:.0%} of the height: too little contrast")
    return float(pixels) / max(last - first, 1)


def mean_arm_thickness(mask: Mask, torso: Torso, columns: NDArray[np.intp], shortest: int) -> float:
    """Median thickness of both arms over their inner three quarters, px.  columns: of the silhouette."""
    thickness = []
    for first, last in ((int(columns[0]), torso.left), (torso.right, int(columns[-1]) + 1)):
        reach = last - first
        if reach < max(shortest, 3):
            raise ValueError(f"no T-pose: an arm reaches {reach} px beside the torso, at least {shortest} expected")
        inner = range(first + reach // 4, last) if first < torso.left else range(first, last - reach // 4)
        thickness += [n for x in inner if (n := int(np.count_nonzero(mask[:, x])))]
    return float(np.median(thickness))


def fine_tuned(anatomy: Anatomy, mask: Mask, camera: Floats, position: Floats, yaw_rotation: Floats) -> Mapping[str, float]:
    """Lengths of the front view after fine-tuning by the matching score, metres.  [Two-view 2.4, (c)]

    mask: (height, width).  camera: (5, 3) level camera rows.  position: (3,) navel.  yaw_rotation: (3, 3) torso to world.
    Raises ValueError when the posture is not the T-pose.
    """
    # Paper (corrected): 2.4 has no bounds; Eq. 1 penalizes p twice as much as n and would inflate the body: 6 %, one pass.
    # Paper (replaced): 2.4 also fine-tunes theta_Z of the shoulders; here the arms are horizontal.
    depth = float(camera[2] @ position + camera[3, 2])
    lengths = dict(front_lengths(mask, Scale(depth, float(camera[4, 0]), float(camera[4, 2]))))
    stretched = limb_directions(anatomy, t_pose_angles(anatomy))

    def score(trial: Mapping[str, float]) -> float:
        hidden = {"torso_depth": p.HIDDEN_TORSO_DEPTH * trial["torso_width"], "head_depth": trial["head_width"]}
        bdp = body_from_lengths(anatomy, dict(trial) | hidden)
        return BodyFit(body_model(anatomy, bdp), camera, mask).place(position, yaw_rotation, stretched)

    for name in p.FINE_TUNED:
        trials = [lengths | {name: lengths[name] * step} for step in p.FINE_STEPS]
        lengths = max(trials, key=score)
    return lengths
