"""Pictures of one frame: estimated and true joints over the silhouette.  [Hybrid Fig. 5]"""

import cv2
import numpy as np

from benchmarks.people.tracker import PersonClip, TrackedPath, trajectories
from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.trajectories import Trajectories

ESTIMATED, TRUTH = "#009e3d", "#e02020"  # as in the paper
SILHOUETTE = 215  # grey level
SIZE_PX = (230, 330)  # width, height of the cut-out
MARGIN_PX = 20  # around the person
WIDTHS_PX = 7, 3  # of the lines: truth, estimate
LIMBS = (("Hip", "Knee"), ("Knee", "Ankle"), ("Shoulder", "Elbow"), ("Elbow", "Wrist"))
BONES = (
    *((f"{side}{one}", f"{side}{other}") for side in "RL" for one, other in LIMBS),
    ("RHip", "LHip"), ("RShoulder", "LShoulder"), ("Hip", "Neck"), ("Neck", "Head"),
)  # fmt: skip


def pose_view(clip: PersonClip, frame: int, path: TrackedPath) -> Image:
    """Cut-out (height, width, 3) RGB of the first view: silhouette, joints of the truth, and of the path if any."""
    view, camera = next(iter(clip.cameras.items()))
    (instant,) = (one for one in clip.instants if one.captured_ns >= 0 and one.frame == frame)
    mask = clip.masks(instant, {view: camera})[view]
    image = np.where(mask[..., None] != 0, SILHOUETTE, 255).astype(np.uint8).repeat(3, axis=2)
    tracks = [(clip.truth, TRUTH)]
    if path.poses:
        tracks.append((trajectories(path, clip.truth.rate), ESTIMATED))
    for (track, colour), width in zip(tracks, WIDTHS_PX, strict=False):
        for one, other in _bones_px(track, frame, camera):
            cv2.line(image, one, other, _rgb(colour), width, cv2.LINE_AA)
    return _cut(mask, image)


def _bones_px(track: Trajectories, frame: int, camera: Camera) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Ends of the bones in the image; none in a frame without a pose."""
    rows = np.flatnonzero(track.frames == frame)
    if not len(rows):
        return []
    points: Floats = camera.project(track.points[rows[0]])
    ends = {name: (round(float(x)), round(float(y))) for name, (x, y) in zip(track.names, points, strict=True)}
    return [(ends[one], ends[other]) for one, other in BONES]


def _cut(mask: Mask, image: Image) -> Image:
    """Part of SIZE_PX of an image around the silhouette, shrunk if the person is larger."""
    rows, columns = np.nonzero(mask)
    middle = np.array([columns.min() + columns.max(), rows.min() + rows.max()]) / 2
    scale = max(1.0, (np.ptp(columns) + MARGIN_PX) / SIZE_PX[0], (np.ptp(rows) + MARGIN_PX) / SIZE_PX[1])
    size = tuple(round(scale * side) for side in SIZE_PX)
    cut = cv2.getRectSubPix(image, size, (float(middle[0]), float(middle[1])))
    return np.asarray(cut if scale == 1.0 else cv2.resize(cut, SIZE_PX, interpolation=cv2.INTER_AREA), np.uint8)


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
