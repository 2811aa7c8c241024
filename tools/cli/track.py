"""The command that tracks videos offline: track."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.formats.export_format import ExportFormat, format_of
from zenocap.common.rig.sources import VIDEO_SUFFIXES
from zenocap.tools.cli.decisions import Decisions
from zenocap.tools.cli.options import DONE, LOSS, UNUSABLE, Method, Variant, one_line_errors, rig_at
from zenocap.tools.cli.progress import progress
from zenocap.tools.cli.suggestions import WrongArgument

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig
    from zenocap.tools.recordings.overlay import Overlay
    from zenocap.tools.recordings.track import Tracked, TrackedFrameSet

Preset = Literal["default", "paper"]
Refinement = Literal["gauss-newton", "force", "force-printed"]
PICTURES = 20  # of an overlay, about
VIDEOS = "Videos of no rig"
TRACKER = "Tracker (methods hybrid, image-force and particle-filter)"


def track(
    source: Annotated[
        list[Path],
        typer.Argument(
            metavar="RIG|VIDEO...",
            help="Rig file (TOML), or folder with calibration.toml and videos/; or the videos of two or more cameras, with "
            "--calibration.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Output file: a take (.mcap), or an export (.bvh, .trc, .c3d, .csv, .glb, .usd) without keeping the take; "
            "default: NAME.mcap, in this folder.",
            show_default=False,
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Calibration of the cameras of VIDEO...", rich_help_panel=VIDEOS),
    ] = None,
    up_axis: Annotated[
        Literal["y", "z"] | None,
        typer.Option(help="Vertical axis of that calibration; default: y.", rich_help_panel=VIDEOS),
    ] = None,
    empty_frames: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=10_000,
            help="First frames of each video without a person; default: the median of the video is the background.",
            rich_help_panel=VIDEOS,
        ),
    ] = None,
    method: Annotated[
        Method | None,
        typer.Option(
            help="Tracking method: two-view uses two views, the others all; default: the rig's, else auto (hybrid)."
        ),
    ] = None,
    variant: Annotated[
        Variant | None,
        typer.Option(
            help="Variant of two-view, which it selects: improved, or as printed in the paper; default: improved."
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Working size of the images (px), such as 160x120; default: the rig's."),
    ] = None,
    fps: Annotated[
        float | None, typer.Option(min=0.1, max=1000, help="Frames per second (FPS) to use; default: the rig's.")
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(
            "--height",
            min=0.5,
            max=2.5,
            metavar="METRES",
            help="Body height (m) for videos without T-pose; the body then gets average proportions.",
        ),
    ] = None,
    preset: Annotated[
        Preset | None,
        typer.Option(
            help="Defaults of all options below and in the rig: zenocap's, or as printed in the paper; default: the rig's.",
            rich_help_panel=TRACKER,
        ),
    ] = None,
    prior: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="Motion prior, such as walking.", rich_help_panel=TRACKER),
    ] = None,
    particles: Annotated[
        int | None,
        typer.Option(
            min=1, max=20_000, help="Number of particles; default: 40, particle-filter 1000.", rich_help_panel=TRACKER
        ),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(
            min=20, max=10_000, help="Number of points on the visual hull; default: 400.", rich_help_panel=TRACKER
        ),
    ] = None,
    iterations: Annotated[
        int | None,
        typer.Option(
            min=0, max=100, help="Iterations of the refinement; default: 4, with forces 40.", rich_help_panel=TRACKER
        ),
    ] = None,
    refinement: Annotated[
        Refinement | None,
        typer.Option(
            help="Least squares, or the paper's forces and moments, corrected or as printed; default: by method.",
            rich_help_panel=TRACKER,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Random seed; equal seeds give identical output; default: 0.", rich_help_panel=TRACKER),
    ] = None,
    both_ways: Annotated[
        bool | None,
        typer.Option(
            "--both-ways/--no-both-ways",
            help="Track a second time, backwards, and use the better pose of each limb; default: on with method hybrid and "
            "preset default.",
            show_default=False,
            rich_help_panel=TRACKER,
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Number of cores to use; the output does not depend on it; default: all.")
    ] = None,
    hardware_decoding: Annotated[
        bool,
        typer.Option(
            "--hardware-decoding",
            help="Decode videos by the graphics card where FFmpeg can; pixels may differ slightly from those in software.",
        ),
    ] = False,
    people: Annotated[
        bool,
        typer.Option(
            "--people",
            help="Correct the silhouettes by a small network, as people = true of every viewer; "
            "`zenocap models add people` gets it.",
        ),
    ] = False,
    decisions: Decisions = Decisions(),  # noqa: B008 - a frozen value
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for pictures and a video of the model over the images.")
    ] = None,
    overlay_every: Annotated[
        int | None, typer.Option(min=1, help="Frames from one overlay picture to the next; default: about 20 pictures.")
    ] = None,
) -> None:
    """Track every frame of a rig's videos offline, and write a take or an export for Blender, OpenSim and others.

    The same steps as live, without network; equal inputs give equal bytes. The body is measured in a T-pose (standing, arms
    stretched sideways); without it, it gets average proportions, improved while the person moves, and two-view needs
    --height. An existing output is replaced. Frames are paired by the times in their
    files. The last lines are the verdict: good, doubtful or unusable, and why; and what to improve at the cameras.
    Exit status 3: done, but the take is
    doubtful, a video ended early, or something was lost or left out; 4: done, but the take is unusable.

    The tracker's method hybrid has a second pass, backwards, which corrects what the first pass noticed too late, such as
    exchanged limbs: exports, pictures and the page show the better poses; those of the first pass stay in the take (`--raw`
    of other commands). It takes half as long again; --no-both-ways leaves it out. Ctrl-C during the second pass leaves the
    take of the first pass.

    Examples: `zenocap track cam01.mp4 cam02.mp4 --calibration calibration.toml`

    `zenocap track clips/walk -o walk.mcap`, then `zenocap export walk.mcap -o walk.bvh`; or in one step:
    `zenocap track clips/walk -o walk.bvh`

    With three or more cameras: `zenocap track clips/walk --method hybrid --prior walking -o walk.mcap`
    """
    working_size = None if size is None else parsed_size(size)
    with one_line_errors():
        from zenocap.common.rig.tracker import TrackerOverrides
        from zenocap.common.runtime import logs
        from zenocap.tools.recordings.rig_changes import (
            at_working_size,
            decoded_by_hardware,
            of_height,
            with_people,
            with_tracker,
        )

        logs.configure("track")
        loaded = _rig(source, Videos(calibration, up_axis, empty_frames), method, variant, decisions.names())
        loaded = decoded_by_hardware(loaded) if hardware_decoding else loaded
        one = at_working_size(with_people(loaded) if people else loaded, working_size, fps)
        output = Path(f"{one.name}.mcap") if output is None else output
        to = format_of(output.suffix)
        front, heading = decisions.front, decisions.heading
        overrides = TrackerOverrides(prior, particles, points, iterations, refinement, seed, preset, front, heading)
        one = with_tracker(one, overrides)
        if height is not None:
            one = of_height(one, height)
        for note in one.notes:
            typer.echo(f"note: {note}", err=True)
        from zenocap.tools.recordings.both_ways import has_second_pass

        two_passes = has_second_pass(one, both_ways)
        expected = expected_frame_sets(one)
        drawing = None if overlay is None else _overlay(one, overlay, overlay_every, expected)
        work = Work(one, expected, drawing, two_passes, jobs)
        if to is None:
            result = _tracked(work, output)
            tracked = (
                " tracked both ways" if result.both_ways else " of the forward pass" if two_passes and result.poses else ""
            )
            typer.echo(f"{output}: {result.frame_sets} frames, {result.poses} poses{tracked}, {result.messages} messages")
            if result.both_ways:
                typer.echo("the poses of the forward pass are in it too: --raw of export, evaluate, render and show")
            following = next_commands(output) if result.poses else ""
        else:
            result, following = _exported(work, output, to), ""
    if drawing is not None:
        shown = ", poses tracked both ways" if result.both_ways else ""
        typer.echo(f"{overlay}: {drawing.finish()} pictures and overlay.mp4{shown}")
    for note in result.notes:
        typer.echo(f"note: {note}", err=True)
    for frames in result.left_out:
        typer.echo(f"left out: {frames}", err=True)
    for problem in result.problems:
        typer.echo(f"lost: {problem}", err=True)
    if result.poses and not result.measured and height is None:
        typer.echo(
            "note: no T-pose was seen: the body has average proportions, adapted while the person moved; lengths may be "
            "some centimetres off",
            err=True,
        )
    if not result.poses:
        typer.echo("no pose: the body is measured when all viewers see a T-pose (arms stretched sideways);", err=True)
        typer.echo("  for videos without it, give --height.  State at the end:", err=True)
        for service, state in result.states.items():
            typer.echo(f"  {service}: {state}", err=True)
    status = _status(result)
    if following:
        typer.echo(following)
    raise typer.Exit(status)


def _status(result: Tracked) -> int:
    """Print the verdict and the advice about the cameras; return the exit status."""
    from zenocap.common.camera_advice import take_lines

    rating = "good" if result.verdict is None else result.verdict.rating
    if result.verdict is not None:
        from zenocap.tools.verdict.text import verdict_lines

        for line in verdict_lines(result.verdict):
            typer.echo(line, err=rating != "good")
    for line in take_lines(result.advice):
        typer.echo(line, err=True)
    if rating == "unusable" or not result.poses:
        return UNUSABLE
    return LOSS if result.problems or result.left_out or rating == "doubtful" else DONE


@dataclass(frozen=True)
class Videos:
    """Options of videos that are given one by one."""

    calibration: Path | None
    up_axis: str | None
    empty_frames: int | None


def _rig(
    source: Sequence[Path], videos: Videos, method: str | None, variant: str | None, cameras: Sequence[str] | None
) -> Rig:
    """The rig of a rig file or folder, or of videos with a calibration.  Raises UserError, WrongArgument."""
    if videos.calibration is not None:
        from zenocap.common.rig.rig import rig_of_videos

        files = [file for path in source for file in videos_in(path)]
        if len(files) < 2:
            raise WrongArgument(f"{' '.join(map(str, source))}: {len(files)} videos; needed: of two or more cameras")
        axis, empty = videos.up_axis or "y", videos.empty_frames or 0
        return rig_of_videos(files, videos.calibration, axis, empty, method, variant, cameras)
    if len(source) == 1 and source[0].suffix.lower() not in VIDEO_SUFFIXES:
        if videos != Videos(None, None, None):
            raise WrongArgument("--up-axis and --empty-frames: allowed with --calibration; a rig or a folder has its own")
        return rig_at(source[0], files=True, method=method, variant=variant, cameras=cameras)
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


@dataclass(frozen=True)
class Work:
    """What is tracked.  expected: number of frame sets, None if unknown.  jobs: number of cores."""

    rig: Rig
    expected: int | None
    drawing: Overlay | None
    two_passes: bool
    jobs: int | None


INTERRUPTED = {  # by the part of the work
    "second": "interrupted in the second pass: {} is complete, with the poses of the forward pass",
    "drawing": "interrupted while the pictures were drawn: {} is complete, with the poses of both passes",
}


def _tracked(work: Work, take: Path, *, kept: bool = True) -> Tracked:
    """Write the take, and draw it, with progress on standard error.  kept: whether the take stays."""
    from zenocap.tools.recordings.both_ways import track_both_ways
    from zenocap.tools.recordings.track import track as run_track

    count, part = 0, "forward"
    try:
        with progress("tracking (the first run compiles for some 20 s)", "frames", work.expected) as state:

            def on_frame_set(frame_set: TrackedFrameSet) -> None:
                nonlocal count
                count += 1
                state.activity = "tracking"
                if work.drawing is not None and not work.two_passes:
                    work.drawing.add(frame_set)
                state.update(count, note=frame_set.state)

            def on_second_pass(activity: str, done: int, total: int) -> None:
                nonlocal part
                if state.activity != activity:
                    part = "second"
                    state.restart(activity, total)
                state.update(done)

            if not work.two_passes:
                return run_track(work.rig, take, on_frame_set, work.jobs)
            result = track_both_ways(work.rig, take, on_frame_set, on_second_pass, work.jobs)
            if work.drawing is not None:
                part = "drawing"
                state.restart("drawing", result.frame_sets)
                _draw(work.rig, take, work.drawing, result, work.jobs, state.update)
            return result
    except KeyboardInterrupt:
        if part in INTERRUPTED and kept:
            typer.echo(INTERRUPTED[part].format(take), err=True)
        raise


def _draw(rig: Rig, take: Path, drawing: Overlay, result: Tracked, jobs: int | None, update: Callable[[int], None]) -> None:
    """Draw the frame sets, which are read again: the poses of both passes are known at the end of the second one."""
    from zenocap.common.formats.take_poses import summary_of
    from zenocap.tools.recordings.track import frame_sets_again

    if result.both_ways:
        summary = summary_of(take)
        drawing.use_body(summary.anatomy, summary.bdp)
    for count, frame_set in enumerate(frame_sets_again(rig, take, jobs), 1):
        drawing.add(frame_set)
        update(count)


def _exported(work: Work, output: Path, to: ExportFormat) -> Tracked:
    """Track into a temporary take and export it; nothing is exported without poses."""
    from zenocap.tools.recordings.export import ExportOptions, export

    with TemporaryDirectory(prefix="zenocap-") as folder:
        take = Path(folder) / f"{output.stem}.mcap"
        result = _tracked(work, take, kept=False)
        if not result.poses:
            typer.echo(f"{result.frame_sets} frames, 0 poses")
            return result
        written = export(take, output, ExportOptions(to.name))
    typer.echo(
        f"{output}: {written.rows} frames, {written.first} to {written.last}, {written.rate:.5g}/s, {written.unit}"
        f"{', tracked both ways' if result.both_ways else ''}; the take was temporary: give -o FILE.mcap to keep it"
    )
    return result


def next_commands(take: Path) -> str:
    """What is usually done next with a take, as commands to copy."""
    name = shlex.quote(str(take))
    return f"next: zenocap show {name}\n      zenocap export {name} -o {shlex.quote(str(take.with_suffix('.bvh')))}"


def parsed_size(text: str) -> tuple[int, int]:
    """(width, height) px of "160x120".  Raises typer.BadParameter."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not found or min(int(found[1]), int(found[2])) < 16:
        raise typer.BadParameter(f"--size {text!r}: allowed: WIDTHxHEIGHT of 16 px or more, such as 160x120")
    return int(found[1]), int(found[2])


def expected_frame_sets(rig: Rig) -> int | None:
    """Estimated number of frame sets in a rig's files; None when no file states its length."""
    from zenocap.services.viewer.sources.source import frame_count

    counts = [count for count in map(frame_count, rig.viewers) if count]
    return max(counts) if counts else None


def _overlay(rig: Rig, folder: Path, every: int | None, expected: int | None) -> Overlay:
    from zenocap.tools.recordings.overlay import Overlay

    return Overlay(rig, folder, every or max(1, (expected or PICTURES) // PICTURES))
