"""The options of `zenocap track`, and the rig that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from zenocap.common.rig.sources import MAX_FIRST, MAX_FIRST_S, VIDEO_SUFFIXES, first_text
from zenocap.tools.cli.options import Variant, camera_list, method_option, parsed_size, rig_at
from zenocap.tools.cli.suggestions import WrongArgument, check_no_other_file
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig

Preset = Literal["default", "paper"]
Refinement = Literal["gauss-newton", "force", "force-printed"]


@dataclass(frozen=True)
class TrackArguments:
    """What is tracked.  cameras: text with commas."""

    calibration: Path | None = option(None, "Calibration of the cameras of VIDEO...", metavar="FILE")
    up_axis: Literal["y", "z"] | None = option(None, "Vertical axis of --calibration; default: y.")
    empty_frames: int | None = option(
        None,
        "First frames of each video without a person; default: of a folder its own, else the median of the video is the "
        "background. Not with a rig file.",
        min=1,
        max=MAX_FIRST,
    )
    empty_seconds: float | None = option(
        None, "The same in seconds, where the frame rates of the cameras differ.", min=0.01, max=MAX_FIRST_S, metavar="S"
    )
    method: str | None = method_option(
        "Tracking method: two-view and both use two views, the others all; default: the rig's, else auto (hybrid)."
    )
    height: float | None = option(
        None, "Body height (m) where no T-pose measures the body. Default: estimated over the floor.",
        min=0.5, max=2.5, metavar="METRES",
    )  # fmt: skip
    cameras: str | None = option(
        None, "Use these cameras only, such as cam01,cam03; two or more. Default: all.", metavar="NAME,NAME..."
    )
    size: str | None = option(None, "Working size of the images (px), such as 160x120; default: the rig's.", metavar="WxH")
    fps: float | None = option(None, "Frames per second (FPS) to use; default: the rig's.", min=0.1, max=1000)
    overlay: Path | None = option(None, "Folder for pictures and a video of the model over the images.", metavar="DIR")


@dataclass(frozen=True)
class TrackExpert:
    """What zenocap decides by itself otherwise.  front: camera, or heading: degrees; at most one of them."""

    front: str | None = option(
        None, "Camera that the person faces at the start, where front and back are exchanged without it.", metavar="CAMERA"
    )
    heading: float | None = option(
        None, "Direction of the person's front at the start: 0 along +Z of the world, 90 along +X. Not with --front.",
        min=-360, max=360, metavar="DEGREES",
    )  # fmt: skip
    prior: str | None = option(None, "Motion prior of the tracker, such as walking.", metavar="NAME|FILE")
    both_ways: bool | None = option(
        None,
        "Track a second time, backwards, and use the better pose of each limb; default: on with method hybrid and "
        "preset default.",
        "--both-ways/--no-both-ways",
    )
    people: bool = option(
        False,
        "Correct the silhouettes by a small network, as people = true of every viewer; "
        "`zenocap models add people` gets it.",
    )
    hardware_decoding: bool = option(
        False, "Decode videos by the graphics card where FFmpeg can; pixels may differ slightly from those in software."
    )
    jobs: int | None = option(None, "Number of cores to use; the output does not depend on it; default: all.", min=1)
    overlay_every: int | None = option(
        None, "Frames from one overlay picture to the next; default: about 20 pictures.", min=1
    )


@dataclass(frozen=True)
class TrackResearch:
    """Variants of the methods; all but `variant` are of the tracker: methods hybrid, image-force and particle-filter."""

    variant: Variant | None = option(
        None, "Variant of two-view, which it selects: improved, or as printed in the paper; default: improved."
    )
    preset: Preset | None = option(
        None,
        "Defaults of the tracker's options, here and in the rig: zenocap's, or as printed in the paper; default: "
        "the rig's.",
    )
    particles: int | None = option(
        None, "Tracker: number of particles; default: 40, particle-filter 1000.", min=1, max=20_000
    )
    points: int | None = option(None, "Tracker: number of points on the visual hull; default: 400.", min=20, max=10_000)
    iterations: int | None = option(
        None, "Tracker: iterations of the refinement; default: 4, of force 40, of force-printed 100.", min=0, max=100
    )
    refinement: Refinement | None = option(
        None, "Tracker: least squares, or the paper's forces and moments, corrected or as printed; default: by method."
    )
    seed: int | None = option(None, "Tracker: random seed; equal seeds give identical output; default: 0.", min=0)


def configured_rig(source: Sequence[Path], given: TrackArguments, expert: TrackExpert, research: TrackResearch) -> Rig:
    """The rig to track, with the options instead of its own.  Raises UserError, WrongArgument, typer.BadParameter."""
    from zenocap.common.rig.tracker import TrackerOverrides
    from zenocap.tools.takes.rig_changes import at_working_size, decoded_by_hardware, with_people, with_tracker

    size = None if given.size is None else parsed_size(given.size)
    rig = _rig(source, given, research.variant)
    rig = decoded_by_hardware(rig) if expert.hardware_decoding else rig
    rig = at_working_size(with_people(rig) if expert.people else rig, size, given.fps)
    overrides = TrackerOverrides(
        expert.prior, research.particles, research.points, research.iterations, research.refinement, research.seed,
        research.preset, expert.front, expert.heading,
    )  # fmt: skip
    rig = with_tracker(rig, overrides)
    return rig if given.height is None else replace(rig, person_height=given.height)


def _rig(source: Sequence[Path], given: TrackArguments, variant: Variant | None) -> Rig:
    """The rig of a rig file or folder, or of videos with a calibration.  Raises UserError, WrongArgument."""
    cameras, background = camera_list(given.cameras), first_text(given.empty_frames, given.empty_seconds)
    if given.calibration is not None:
        from zenocap.common.rig.folder import MEDIAN
        from zenocap.common.rig.rig import rig_of_videos

        files = [file for path in source for file in videos_in(path)]
        for file in files:
            check_no_other_file(file)
        if len(files) < 2:
            raise WrongArgument(f"{' '.join(map(str, source))}: {len(files)} videos; needed: of two or more cameras")
        axis = given.up_axis or "y"
        return rig_of_videos(files, given.calibration, axis, background or MEDIAN, given.method, variant, cameras)
    if len(source) == 1 and source[0].suffix.lower() not in VIDEO_SUFFIXES:
        if given.up_axis is not None:
            raise WrongArgument("--up-axis: allowed with --calibration; a rig or a folder has its own")
        return rig_at(source[0], files=True, method=given.method, variant=variant, cameras=cameras, background=background)
    for path in source:
        check_no_other_file(path)
    names = " ".join(map(str, source))
    if all(path.suffix.lower() in VIDEO_SUFFIXES for path in source):
        raise WrongArgument(
            f"{names}: videos need --calibration FILE, the file of their cameras (Pose2Sim, anipose, caliscope, OpenCV or "
            "Qualisys); `zenocap calibrate --help` shows how to make one"
        )
    raise WrongArgument(f"{names}: allowed: one rig file or folder, or videos with --calibration FILE")


def videos_in(path: Path) -> list[Path]:
    """The videos of a folder, or of videos/ in it, by name; a file is itself."""
    from zenocap.common.rig.folder import with_suffix

    if not path.is_dir():
        return [path]
    folder = path / "videos" if (path / "videos").is_dir() else path
    return with_suffix(folder, VIDEO_SUFFIXES)
