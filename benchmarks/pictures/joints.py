"""Points of every joint convention on the tracker's average body, for `docs/conventions.md`."""

from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.joint_conventions import CONVENTIONS, TITLES, Convention, origin_of, points_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.services.tracker.body.average_body import average_body

HEIGHT_M = 1.75
PX_PER_M, TOP_M, FOOT_M = 420, 1.86, -0.06
FRONT_M, SIDE_M = 1.0, 0.62  # widths of the two views
SCALE = 2  # drawn larger and reduced, for smooth edges
ARM, ELBOW = np.radians(22), np.radians(15)  # abduction and flexion, so that no part hides another
BACKGROUND, BODY, EDGE, TEXT = (255, 255, 255), (225, 222, 220), (190, 186, 184), (60, 60, 60)
COLOURS = {"measured": (60, 140, 30), "share": (0, 150, 240), "derived": (200, 80, 40)}  # BGR
# Labels in the side view, and their places right of and below the point, pixels; the others are labelled in front.
BESIDE = {
    "RHeel": (-22, -8), "RBigToe": (8, 3), "RSmallToe": (-30, 20), "Nose": (8, 10), "REye": (8, 0), "REar": (-32, 3),
    "Head": (8, 4), "Neck": (8, 4),
}  # fmt: skip
LEGEND = {
    "measured": "measured: joint or end of a segment",
    "share": "share of a measured segment",
    "derived": "derived by an offset",
}


def pose_and_body() -> tuple[Pose, Floats]:
    """Standing pose with the ankles above y = 0.068, and the part frames of the average body."""
    angles = FOURTEEN_PARTS.neutral.copy()
    angles[FOURTEEN_PARTS.index["right_shoulder.z"]] -= ARM
    angles[FOURTEEN_PARTS.index["left_shoulder.z"]] += ARM
    for side in ("right", "left"):
        angles[FOURTEEN_PARTS.index[f"{side}_elbow.x"]] = ELBOW
    pose = Pose(np.array([0.0, 0.519 * HEIGHT_M, 0.0]), angles)
    return pose, part_frames(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, HEIGHT_M), pose)


def panel(convention: Convention, side: bool) -> Image:
    """One view of the body with the points of a convention: from the front, or from its right side."""
    body = average_body(FOURTEEN_PARTS, HEIGHT_M)
    pose, frames = pose_and_body()
    width = SIDE_M if side else FRONT_M
    scale = SCALE * PX_PER_M
    image = np.full((round(scale * (TOP_M - FOOT_M)), round(scale * width), 3), BACKGROUND, dtype=np.uint8)

    def pixels(points: Floats) -> Floats:
        across = points[:, 2] - 0.04 if side else points[:, 0]
        return np.stack([scale * (across + width / 2), scale * (TOP_M - points[:, 1])], axis=1)

    for ellipses in body_ellipses(body, frames):
        hull = cv2.convexHull(np.rint(pixels(ellipses)).astype(np.int32))
        cv2.fillConvexPoly(image, hull, BODY, cv2.LINE_AA)
        cv2.polylines(image, [hull], True, EDGE, SCALE, cv2.LINE_AA)
    found = keypoints(convention, FOURTEEN_PARTS, body).at(pose)
    placed = np.rint(pixels(found)).astype(int).tolist()
    for point, (x, y) in zip(points_of(convention, FOURTEEN_PARTS), placed, strict=True):
        if side and point.name.startswith("L"):
            continue  # behind the right side
        cv2.circle(image, (x, y), 4 * SCALE, COLOURS[origin_of(point, FOURTEEN_PARTS)], -1, cv2.LINE_AA)
        if side and point.name in BESIDE:
            right, down = BESIDE[point.name]
            _write(image, point.name, x + right * SCALE, y + down * SCALE)
        elif not side and point.name not in BESIDE and not point.name.startswith("L"):
            _write(image, point.name, x - (7 + 6 * len(point.name)) * SCALE, y - 5 * SCALE)
    title = f"{TITLES[convention]}, from the right" if side else f"{TITLES[convention]}: {len(found)} points"
    cv2.putText(image, title, (8 * SCALE, 16 * SCALE), cv2.FONT_HERSHEY_SIMPLEX, 0.45 * SCALE, TEXT, SCALE, cv2.LINE_AA)
    return np.asarray(cv2.resize(image, None, fx=1 / SCALE, fy=1 / SCALE, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _write(image: Image, words: str, x: int, y: int) -> None:
    cv2.putText(image, words, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.36 * SCALE, TEXT, SCALE, cv2.LINE_AA)


def legend(width: int) -> Image:
    image = np.full((30, width, 3), BACKGROUND, dtype=np.uint8)
    for k, (origin, words) in enumerate(LEGEND.items()):
        x = 16 + k * 330
        cv2.circle(image, (x, 14), 5, COLOURS[origin], -1, cv2.LINE_AA)
        cv2.putText(image, words, (x + 12, 19), cv2.FONT_HERSHEY_SIMPLEX, 0.45, TEXT, 1, cv2.LINE_AA)
    return image


def draw(folder: Path) -> None:
    """Write joints.png."""
    rows = [
        np.hstack([panel(convention, side) for convention in pair for side in (False, True)])
        for pair in (CONVENTIONS[:2], CONVENTIONS[2:])
    ]
    cv2.imwrite(str(folder / "joints.png"), np.vstack([*rows, legend(rows[0].shape[1])]))
