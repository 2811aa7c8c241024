"""The real clip: distance to the reference, overlap with the silhouettes by view, images."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from benchmarks.hybrid.accuracy import mediapipe
from benchmarks.hybrid.angles import ANGLE_COLUMNS, ANGLE_NOTE, angle_cells, errors_against_angles, file_angles
from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.figures import figure, starts, summary, with_worst
from benchmarks.hybrid.runs import ANATOMY, NAMES, Case, TrackedPath, track_clip
from benchmarks.hybrid.silhouettes import Clip
from benchmarks.sections import Row, Section, Table
from zenocap.common.arrays import Image, Mask
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.recordings.overlay import side_by_side

CLIP = "real_beam4"
# No file states the man's height.  The medians of the reference's segments add up to 1.73 m: crown to neck 0.29, neck to
# hips 0.54, thigh 0.42, shank 0.41, ankle above the floor 0.07; 1.72 is the example in Pose2Sim's configuration.
HEIGHT_M = 1.72
STARTS: dict[str, Case] = {
    "T-pose film (`stretched/`)": Case(CLIP),
    f"`--height {HEIGHT_M}`, without T-pose": Case(CLIP, t_pose=False, height=HEIGHT_M),
    "any posture, without T-pose": Case(CLIP, t_pose=False),
}
PRIORS = ("", "walking", "general")
DRAWN = "walking"
AIM_MM = 70.0
PICTURES = 6
LONG_SIDE_PX = 520
DIMMED = 0.6
PERSON, MODEL = (255, 255, 255), (80, 200, 80)


def beam(bench: Bench) -> Section:
    wanted = {(start, prior): replace(case, prior=prior) for start, case in STARTS.items() for prior in PRIORS}
    runs = bench.runs(list(wanted.values()))
    clip = bench.clip(CLIP)
    rows: list[Row] = []
    joints: list[Row] = []
    angles: list[Row] = []
    ends: list[Row] = []
    reference = file_angles(bench.places.clips / CLIP / "inverse_kinematics" / "angles.mot")
    for (start, prior), case in wanted.items():
        one, title = summary(runs[case]), f"{start}, prior {prior or 'none'}"
        errors = (with_worst(value, 0) for value in (one.mean, one.rmse, one.shape))
        rows.append((title, starts(runs[case]), *errors, with_worst(one.lost), one.losses, one.never, f"{AIM_MM:g}"))
        ends.append((title, "; ".join(dict.fromkeys(run.ended for run in runs[case]))))
        each = [figure([run.per_joint_mm.get(name, float("nan")) for run in runs[case]]).mean for name in NAMES]
        joints.append((title, *each))
        angles.append((title, *angle_cells([errors_against_angles(run, reference) for run in runs[case]])))
    others = mediapipe(bench.places.clips / "mediapipe.md").get(CLIP, (float("nan"),) * 4)
    rows.append(("MediaPipe", "", *others, "", "", ""))
    path = track_clip(clip, Case(CLIP, prior=DRAWN), read_prior(bench.priors.path(DRAWN), ANATOMY))
    overlap_by_view = overlaps(clip, path)
    overlap = tuple(_overlap(view, percentages) for view, percentages in overlap_by_view.items())
    return Section(
        "beam",
        "Real video: real_beam4",
        (
            f"{bench.seeds} seeds, the worst in brackets, 4 views.  T-pose film: as `zenocap track` of the clip's folder "
            "does, the body is measured in 11 frames of the initial posture from another moment.  The reference is "
            "OpenPose, triangulated: a few centimetres from the truth itself, its joints are not the model's, and its head "
            "is another point.",
            "Angles against OpenSim's inverse kinematics of the same key points (`angles.mot`), over the frames with a "
            f"pose.  {ANGLE_NOTE}",
            f"Overlap: pixels in both the silhouette and the projected model, of those in either, in %; "
            f"prior {DRAWN}, T-pose film, seed 0.",
        ),
        (
            Table(
                "Distance to the reference",
                ("start", "first pose", "mean mm", "RMSE mm", "shape mm", "lost %", "losses", "never", "aim mean"),
                tuple(rows),
            ),
            Table("Angles: RMS / RMS without the constant offset, degrees", ("start", *ANGLE_COLUMNS), tuple(angles)),
            Table("State of the tracker after the last frame", ("start", "state"), tuple(ends)),
            Table("Overlap by view, %", ("view", "mean", "median", "least", "frames"), overlap),
            Table("Mean distance by joint, mm", ("start", *NAMES), tuple(joints)),
        ),
        tuple(pictures(bench, clip, path)),
    )


def _overlap(view: str, percentages: list[float]) -> Row:
    if not percentages:
        return (view, *[float("nan")] * 3, 0)
    return (view, float(np.mean(percentages)), float(np.median(percentages)), min(percentages), len(percentages))


def overlaps(clip: Clip, path: TrackedPath) -> dict[str, list[float]]:
    """By view: percentage of intersection over union of silhouette and projected model, in every frame with a pose."""
    overlap_by_view: dict[str, list[float]] = {view: [] for view in clip.cameras}
    for instant in clip.instants:
        if instant.captured_ns < 0 or instant.frame not in path.poses:
            continue
        for view, mask in clip.masks(instant, clip.cameras).items():
            model = projected(clip.cameras[view], path, instant.frame)
            either = np.count_nonzero(mask | model)
            if either and mask.any():
                overlap_by_view[view].append(100.0 * np.count_nonzero(mask & model) / either)
    return overlap_by_view


def projected(camera: Camera, path: TrackedPath, frame: int) -> Mask:
    """(height, width) 1 on the body in that frame."""
    width, height = camera.size
    mask = np.zeros((height, width), np.uint8)
    for hull in outlines(camera, path, frame):
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), (1,))
    return mask


def outlines(camera: Camera, path: TrackedPath, frame: int) -> list[np.ndarray[tuple[int, int, int], np.dtype[np.float32]]]:
    """Convex outline of every part in front of the camera, px."""
    body, pose = path.poses[frame]
    found = []
    for ellipses in body_ellipses(body, part_frames(ANATOMY, body, pose)):
        points = camera.project(ellipses)
        if np.all(np.isfinite(points)) and np.abs(points).max() < 1e5:
            found.append(np.asarray(cv2.convexHull(points.astype(np.float32)), dtype=np.float32))
    return found


def pictures(bench: Bench, clip: Clip, path: TrackedPath) -> Sequence[str]:
    """Every view of some frames: image, contour of the silhouette (white), parts of the model (green)."""
    if not path.poses:
        return []
    frames = {int(frame) for frame in np.linspace(min(path.poses), max(path.poses), PICTURES)} & set(path.poses)
    masks = {one.frame: clip.masks(one, clip.cameras) for one in clip.instants if one.captured_ns >= 0}
    views: dict[int, list[Image]] = {frame: [] for frame in sorted(frames)}
    for viewer in clip.rig.viewers:
        for frame in open_source(viewer, Playback(EPOCH_NS, ManualClock(EPOCH_NS), live=False)):
            if frame.initial or frame.frame not in views:
                continue
            image = np.asarray(frame.image * DIMMED, dtype=np.uint8)
            contours, _ = cv2.findContours(masks[frame.frame][viewer.id], cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            cv2.drawContours(image, contours, -1, PERSON, 1)
            for hull in outlines(viewer.camera, path, frame.frame):
                cv2.polylines(image, [np.round(hull).astype(np.int32)], True, MODEL, 1, cv2.LINE_AA)
            views[frame.frame].append(_shrunk(image))
    names = []
    for number, images in views.items():
        names.append(f"beam-{number:03d}.png")
        cv2.imwrite(str(bench.places.out / names[-1]), side_by_side(images))
    return names


def _shrunk(image: Image) -> Image:
    """At most LONG_SIDE_PX in either direction."""
    scale = LONG_SIDE_PX / max(image.shape[:2])
    return np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
