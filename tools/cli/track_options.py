"""The options of `zenocap track`, and the rig that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.rig.sources import VIDEO_SUFFIXES
from zenocap.tools.cli.options import Method, Variant, camera_list, parsed_size, rig_at
from zenocap.tools.cli.suggestions import WrongArgument

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig

Preset = Literal["default", "paper"]
Refinement = Literal["gauss-newton", "force", "force-printed"]


@dataclass(frozen=True)
class TrackArguments:
    """What is tracked.  cameras: text with commas."""

    calibration: Annotated[Path | None, typer.Option(metavar="FILE", help="Calibration of the cameras of VIDEO...")] = None
    up_axis: Annotated[Literal["y", "z"] | None, typer.Option(help="Vertical axis of --calibration; default: y.")] = None
    empty_frames: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=10_000,
            help="With --calibration: first frames of each video without a person; default: the median of the video is the "
            "background.",
        ),
    ] = None
    method: Annotated[
        Method | None,
        typer.Option(
            help="Tracking method: two-view uses two views, the others all; default: the rig's, else auto (hybrid)."
        ),
    ] = None
    height: Annotated[
        float | None,
        typer.Option(
            "--height",
            min=0.5,
            max=2.5,
            metavar="METRES",
            help="Body height (m) for videos without T-pose; the body then gets average proportions.",
        ),
    ] = None
    cameras: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME...", help="Use these cameras only, such as cam01,cam03; two or more. Default: all."
        ),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Working size of the images (px), such as 160x120; default: the rig's."),
    ] = None
    fps: Annotated[
        float | None, typer.Option(min=0.1, max=1000, help="Frames per second (FPS) to use; default: the rig's.")
    ] = None
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for pictures and a video of the model over the images.")
    ] = None


@dataclass(frozen=True)
class TrackExpert:
    """What zenocap decides by itself otherwise.  front: camera, or heading: degrees; at most one of them."""

    front: Annotated[
        str | None,
        typer.Option(
            metavar="CAMERA",
            help="Camera that the person faces at the start, where front and back are exchanged without it.",
        ),
    ] = None
    heading: Annotated[
        float | None,
        typer.Option(
            min=-360,
            max=360,
            metavar="DEGREES",
            help="Direction of the person's front at the start: 0 along +Z of the world, 90 along +X. Not with --front.",
        ),
    ] = None
    prior: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="Motion prior of the tracker, such as walking.")
    ] = None
    both_ways: Annotated[
        bool | None,
        typer.Option(
            "--both-ways/--no-both-ways",
            help="Track a second time, backwards, and use the better pose of each limb; default: on with method hybrid and "
            "preset default.",
            show_default=False,
        ),
    ] = None
    people: Annotated[
        bool,
        typer.Option(
            "--people",
            help="Correct the silhouettes by a small network, as people = true of every viewer; "
            "`zenocap models add people` gets it.",
        ),
    ] = False
    hardware_decoding: Annotated[
        bool,
        typer.Option(
            "--hardware-decoding",
            help="Decode videos by the graphics card where FFmpeg can; pixels may differ slightly from those in software.",
        ),
    ] = False
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Number of cores to use; the output does not depend on it; default: all.")
    ] = None
    overlay_every: Annotated[
        int | None, typer.Option(min=1, help="Frames from one overlay picture to the next; default: about 20 pictures.")
    ] = None


@dataclass(frozen=True)
class TrackResearch:
    """Variants of the methods; all but `variant` are of the tracker: methods hybrid, image-force and particle-filter."""

    variant: Annotated[
        Variant | None,
        typer.Option(
            help="Variant of two-view, which it selects: improved, or as printed in the paper; default: improved."
        ),
    ] = None
    preset: Annotated[
        Preset | None,
        typer.Option(
            help="Defaults of the tracker's options, here and in the rig: zenocap's, or as printed in the paper; default: "
            "the rig's."
        ),
    ] = None
    particles: Annotated[
        int | None,
        typer.Option(min=1, max=20_000, help="Tracker: number of particles; default: 40, particle-filter 1000."),
    ] = None
    points: Annotated[
        int | None, typer.Option(min=20, max=10_000, help="Tracker: number of points on the visual hull; default: 400.")
    ] = None
    iterations: Annotated[
        int | None,
        typer.Option(min=0, max=100, help="Tracker: iterations of the refinement; default: 4, with forces 40."),
    ] = None
    refinement: Annotated[
        Refinement | None,
        typer.Option(
            help="Tracker: least squares, or the paper's forces and moments, corrected or as printed; default: by method."
        ),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Tracker: random seed; equal seeds give identical output; default: 0."),
    ] = None


def configured_rig(source: Sequence[Path], given: TrackArguments, expert: TrackExpert, research: TrackResearch) -> Rig:
    """The rig to track, with the options instead of its own.  Raises UserError, WrongArgument, typer.BadParameter."""
    from zenocap.common.rig.tracker import TrackerOverrides
    from zenocap.tools.recordings.track import at_working_size, decoded_by_hardware, of_height, with_people, with_tracker

    size = None if given.size is None else parsed_size(given.size)
    rig = _rig(source, given, research.variant)
    rig = decoded_by_hardware(rig) if expert.hardware_decoding else rig
    rig = at_working_size(with_people(rig) if expert.people else rig, size, given.fps)
    overrides = TrackerOverrides(
        expert.prior, research.particles, research.points, research.iterations, research.refinement, research.seed,
        research.preset, expert.front, expert.heading,
    )  # fmt: skip
    rig = with_tracker(rig, overrides)
    return rig if given.height is None else of_height(rig, given.height)


def _rig(source: Sequence[Path], given: TrackArguments, variant: Variant | None) -> Rig:
    """The rig of a rig file or folder, or of videos with a calibration.  Raises UserError, WrongArgument."""
    cameras = camera_list(given.cameras)
    if given.calibration is not None:
        from zenocap.common.rig.rig import rig_of_videos

        files = [file for path in source for file in videos_in(path)]
        if len(files) < 2:
            raise WrongArgument(f"{' '.join(map(str, source))}: {len(files)} videos; needed: of two or more cameras")
        axis, empty = given.up_axis or "y", given.empty_frames or 0
        return rig_of_videos(files, given.calibration, axis, empty, given.method, variant, cameras)
    if len(source) == 1 and source[0].suffix.lower() not in VIDEO_SUFFIXES:
        if given.up_axis is not None or given.empty_frames is not None:
            raise WrongArgument("--up-axis and --empty-frames: allowed with --calibration; a rig or a folder has its own")
        return rig_at(source[0], files=True, method=given.method, variant=variant, cameras=cameras)
    names = " ".join(map(str, source))
    if all(path.suffix.lower() in VIDEO_SUFFIXES for path in source):
        raise WrongArgument(
            f"{names}: videos need --calibration FILE, the file of their cameras (Pose2Sim, anipose, caliscope, OpenCV or "
            "Qualisys); `zenocap calibrate --help` shows how to make one"
        )
    raise WrongArgument(f"{names}: allowed: one rig file or folder, or videos with --calibration FILE")


def videos_in(path: Path) -> list[Path]:
    """The videos of a folder, or of videos/ in it, by name; a file is itself."""
    if not path.is_dir():
        return [path]
    folder = path / "videos" if (path / "videos").is_dir() else path
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in VIDEO_SUFFIXES)
