"""Offline tracking: `track` turns the videos of a rig into a take."""

import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.folder import MEDIAN
from zenocap.common.rig.rig import Rig, load_rig, rig_of_videos
from zenocap.common.rig.sources import first_text
from zenocap.common.rig.tracker import TrackerOverrides
from zenocap.take import Take, open_take
from zenocap.tools.takes.both_ways import has_second_pass, track_both_ways
from zenocap.tools.takes.rig_changes import at_working_size, decoded_by_hardware, with_tracker
from zenocap.tools.takes.track import TrackedFrameSet
from zenocap.tools.takes.track import track as write_take

logger = logging.getLogger(__name__)

Progress = Callable[[int], None]


def track(
    source: Rig | Path | str | Sequence[Path | str],
    output: Path | str,
    *,
    calibration: Path | str | None = None,
    empty_frames: int | None = None,
    empty_seconds: float | None = None,
    up_axis: str = "y",
    method: str | None = None,
    variant: str | None = None,
    preset: str | None = None,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
    height: float | None = None,
    prior: str | None = None,
    seed: int | None = None,
    both_ways: bool | None = None,
    cameras: Sequence[str] | None = None,
    front: str | None = None,
    heading: float | None = None,
    hardware_decoding: bool = False,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Take:
    """Track every frame of a rig's videos and write the take to `output`; equal input gives an equal file.

    source: a rig, a rig file, a folder with `calibration.toml` and `videos/` (Pose2Sim layout), or a list of videos.
    calibration: with a list of videos: the file of their cameras (anipose, Pose2Sim, OpenCV or Qualisys); videos are
        matched to cameras by name, or by order where no name fits.
    empty_frames, empty_seconds: with a folder or a list of videos: beginning of each that shows the empty scene, one of
        them; default: that of the folder, or the background is the median of the video.
    up_axis: of the calibration of a list of videos, "y" or "z".
    method: "auto" or "hybrid" (two to eight cameras), "two-view" or "both" of them (two); default: the rig's own, else
        "auto".
    variant: of two-view, "improved" or "paper", as printed; default: the rig's own, else "improved".
    preset: of the hybrid tracker, "default" or "paper", as printed; default: the rig's own, else "default".
    size: working size (width, height), pixels; default: the rig's.
    fps: frames per second that are used; default: the rig's.
    height: of the person, metres, where no T-pose measures the body; default: as seen over the floor.
    prior: motion prior of the hybrid tracker, a name or a file.
    seed: random seed of the hybrid tracker.
    both_ways: track a second time, backwards, and use the better pose of each limb; default: with method hybrid and preset
        default.  `open_take(path, raw=True)` has the poses of the first pass; `Take.both_ways` is False without a second.
    cameras: names of cameras or ids of viewers, two or more; the others are not used; default: all.
    front: camera that the person faces at the start; heading: direction of the front then, degrees, 0 along +Z of the
        world, 90 along +X; at most one of them; default: the rig's own, else as the feet show.
    hardware_decoding: decode videos by the graphics card where FFmpeg can; pixels may differ slightly.
    jobs: number of cores to use; the take does not depend on it; default: the available ones.
    progress: called after each frame set of the first pass with the number of frame sets so far.

    Raises UserError: a missing video, a calibration of other cameras, or a person whose body could not be measured.
    """
    overrides = TrackerOverrides(prior=prior, seed=seed, preset=preset, front=front, heading=heading)
    background = first_text(empty_frames, empty_seconds)
    if isinstance(source, Rig | Path | str):
        if calibration is not None:
            raise UserError("calibration: allowed with a list of videos; a rig or a folder has its own")
        if isinstance(source, Rig) and background is not None:
            raise UserError("empty_frames and empty_seconds: allowed with files or a folder; a rig has its own")
        if isinstance(source, Rig) and (method is not None or variant is not None):
            raise UserError("method and variant: allowed with files or a folder; a rig has been loaded with its own")
        if isinstance(source, Rig) and cameras is not None:
            raise UserError("cameras: allowed with files or a folder; for a rig: Rig.load(path, cameras=...)")
        if isinstance(source, Rig):
            rig = source
        else:
            rig = load_rig(source, method, variant=variant, cameras=cameras, background=background)
    else:
        if calibration is None:
            raise UserError("calibration is missing: a list of videos needs the file of their cameras")
        videos = [Path(video) for video in source]
        rig = rig_of_videos(videos, Path(calibration), up_axis, background or MEDIAN, method, variant, cameras)
    rig = decoded_by_hardware(rig) if hardware_decoding else rig
    rig = with_tracker(at_working_size(rig, size, fps), overrides)
    rig = rig if height is None else replace(rig, person_height=height)
    frame_sets, path = itertools.count(1), Path(output)

    def on_frame_set(_: TrackedFrameSet) -> None:
        if progress is not None:
            progress(next(frame_sets))

    if has_second_pass(rig, both_ways):
        result = track_both_ways(rig, path, on_frame_set, jobs=jobs)
    else:
        result = write_take(rig, path, on_frame_set, jobs)
    for problem in (*result.left_out, *result.problems):
        logger.warning("%s: %s", path, problem)
    return open_take(path)
