"""The command that tracks videos offline: track."""

from __future__ import annotations

import shlex
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.formats.export_format import FORMATS, ExportFormat, format_of
from zenocap.tools.cli.options import DONE, LOSS, UNUSABLE, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.cli.suggestions import WrongArgument
from zenocap.tools.cli.track_options import TrackArguments, TrackExpert, TrackResearch, configured_rig
from zenocap.tools.option_groups import EXPERT, RESEARCH

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig
    from zenocap.tools.takes.track import Tracked
    from zenocap.tools.takes.track_job import TrackJob

Source = Annotated[
    list[Path],
    typer.Argument(
        metavar="RIG|VIDEO...",
        help="Rig file (TOML), or folder with calibration.toml and videos/; or the videos of two or more cameras, with "
        "--calibration.",
    ),
]
OutputOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="Output file: a take (.mcap), or without keeping the take an export, by a suffix that `zenocap export` knows; "
        "default: NAME.mcap, in this folder.",
    ),
]
OTHER_HEIGHT = 0.04  # of the given height, from which that in the T-pose is noted; simulated people: off by up to 0.011
INTERRUPTED = {  # by the part of the work
    "second": "interrupted in the second pass: {} is complete, with the poses of the forward pass",
    "drawing": "interrupted while the pictures were drawn: {} is complete, with the poses of both passes",
}


def track(
    source: Source, output: OutputOption = None, *, given: TrackArguments, expert: Annotated[TrackExpert, EXPERT],
    research: Annotated[TrackResearch, RESEARCH],
) -> None:  # fmt: skip
    """Track videos: make a take, or a file for Blender or OpenSim.

    Every frame of a rig's videos is tracked offline; the output is a take, or an export for other programs. The same
    steps as live, without network; equal inputs give equal bytes. The body is measured in a T-pose (standing, arms
    stretched sideways); without it, it gets average proportions and the height that the cameras see over the floor, which
    --height corrects. An existing output that is named is replaced. Frames are paired by the times in their files. The
    last lines are the verdict: good, doubtful or unusable, and why; and what to improve at the cameras. Exit status 3:
    done, but the take is doubtful, a video ended early, or something was lost or left out; 4: done, but it is unusable.

    The tracker's method hybrid has a second pass, backwards, which corrects what the first pass noticed too late, such as
    exchanged limbs: exports, pictures and the page show the better poses; those of the first pass stay in the take (`--raw`
    of other commands). --no-both-ways leaves it out; Ctrl-C during it leaves the take of the first pass.

    Examples: `zenocap track cam01.mp4 cam02.mp4 --calibration calibration.toml`

    `zenocap track clips/walk -o walk.mcap`, then `zenocap export walk.mcap -o walk.bvh`; or in one step:
    `zenocap track clips/walk -o walk.bvh`

    With three or more cameras: `zenocap track clips/walk --method hybrid --prior walking -o walk.mcap`
    """
    with one_line_errors():
        _check_output(output)
        job = _job(source, given, expert, research)
        named, output = output, output or Path(f"{job.rig.name}.mcap")
        if named is None and output.exists():
            raise WrongArgument(f"{output} is there already: allowed: -o FILE, which may replace it")
        to = format_of(output.suffix)
        result = _tracked(job, output) if to is None else _exported(job, output, to)
    _print_drawn(job, given.overlay, result)
    _print_losses(result, job.rig)
    status = _status(result)
    if to is None and result.poses:
        typer.echo(next_commands(output, source[0]))
    raise typer.Exit(status)


def _check_output(output: Path | None) -> None:
    """A note where it is there.  Raises WrongArgument for an output that is neither a take nor an export."""
    if output is not None and output.suffix.lower() != ".mcap" and format_of(output.suffix) is None:
        known = sorted({suffix for one in FORMATS.rows().values() for suffix in one.suffixes})
        raise WrongArgument(f"-o {output}: allowed: a take (.mcap), or an export ({', '.join(known)})")
    if output is not None and output.exists():
        typer.echo(f"note: {output} is there and will be replaced", err=True)


def _job(source: list[Path], given: TrackArguments, expert: TrackExpert, research: TrackResearch) -> TrackJob:
    """The work to do, with notes on standard error.  Raises as `configured_rig`."""
    from zenocap.common.runtime import logs
    from zenocap.tools.takes.both_ways import has_second_pass
    from zenocap.tools.takes.track_job import TrackJob, overlay

    logs.configure("track")
    rig = configured_rig(source, given, expert, research)
    for note in rig.notes:
        typer.echo(f"note: {note}", err=True)
    two_passes = has_second_pass(rig, expert.both_ways)
    drawing = None if given.overlay is None else overlay(rig, given.overlay, expert.overlay_every)
    return TrackJob(rig, drawing, two_passes, expert.jobs)


def _tracked(job: TrackJob, take: Path) -> Tracked:
    """Write the take, and say what is in it.  Raises as `TrackJob.run`."""
    result = _run(job, take)
    passes = " of the forward pass" if job.two_passes and result.poses else ""
    passes = " tracked both ways" if result.both_ways else passes
    t_pose = f" ({result.initial} of the separate T-pose)" if result.initial else ""
    typer.echo(f"{take}: {result.frame_sets} frames{t_pose}, {result.poses} poses{passes}, {result.messages} messages")
    if result.both_ways:
        typer.echo("the poses of the forward pass are in it too: --raw of export, evaluate, render and show")
    return result


def _exported(job: TrackJob, output: Path, to: ExportFormat) -> Tracked:
    """Track into a temporary take and export it; nothing is exported without poses.  Raises as `TrackJob.run`."""
    from zenocap.tools.cli.export import notes_of
    from zenocap.tools.takes.export import ExportOptions, export

    with TemporaryDirectory(prefix="zenocap-") as folder:
        take = Path(folder) / f"{output.stem}.mcap"
        result = _run(job, take, kept=False)
        if not result.poses:
            typer.echo(f"{result.frame_sets} frames, 0 poses")
            return result
        written = export(take, output, ExportOptions(to.name))
    typer.echo(
        f"{output}: {written.rows} frames, {written.first} to {written.last}, {written.rate:.5g}/s, {written.unit}"
        f"{', tracked both ways' if result.both_ways else ''}; the take was temporary: give -o FILE.mcap to keep it"
    )
    for note in notes_of(to, written):
        typer.echo(f"note: {note}", err=True)
    return result


def _run(job: TrackJob, take: Path, *, kept: bool = True) -> Tracked:
    """Track with progress on standard error.  kept: whether the take stays."""
    from zenocap.tools.takes.track_job import expected_frame_sets

    try:
        with progress("tracking (the first run compiles for some 20 s)", "frames", expected_frame_sets(job.rig)) as state:
            return job.run(take, state)
    except KeyboardInterrupt:
        if kept and job.part in INTERRUPTED:
            typer.echo(INTERRUPTED[job.part].format(take), err=True)
        raise


def _print_drawn(job: TrackJob, folder: Path | None, result: Tracked) -> None:
    """Complete the pictures in that folder, and print their number."""
    if job.drawing is not None:
        shown = ", poses tracked both ways" if result.both_ways else ""
        typer.echo(f"{folder}: {job.drawing.finish()} pictures and overlay.mp4{shown}")


def _print_losses(result: Tracked, rig: Rig) -> None:
    """Print what is missing or unusual."""
    from zenocap.common.rig.methods import method_of

    lines = [f"note: {note}" for note in result.notes]
    lines += [f"left out: {frames}" for frames in result.left_out]
    lines += [f"lost: {problem}" for problem in result.problems]
    has_tracker = method_of(rig.method).has_tracker
    given, found = rig.person_height, result.height
    if result.poses and given is not None and not result.measured:
        lines.append(f"note: height {given:g} m: the body has average proportions; no T-pose has measured it")
    elif given is not None and found is not None and abs(found / given - 1) > OTHER_HEIGHT:
        lines.append(
            f"note: in the T-pose the person is {found:.2f} m tall, not {given:.2f} m as given: the body is as measured; "
            "check the height, and the scale of the calibration"
        )
    if result.poses and not result.measured and rig.person_height is None:
        estimated = (
            "" if result.estimated is None else f", of {result.estimated:.2f} m from the floor to the top of the head"
        )
        adapted = ", adapted while the person moved" if has_tracker else ""
        lines.append(
            f"note: no T-pose was seen: the body has average proportions{estimated}{adapted}; "
            "lengths may be some centimetres off: --height METRES gives the height where it is another one"
        )
    if not result.poses:
        if rig.person_height is None and not has_tracker:
            lines.append(
                "no pose: no T-pose (arms stretched sideways) that both viewers see, and the height over the floor"
            )
            lines.append("  cannot be estimated from the silhouettes: give --height METRES.  State at the end:")
        else:
            lines.append("no pose.  State at the end:")
        lines += [f"  {service}: {state}" for service, state in result.states.items()]
    for line in lines:
        typer.echo(line, err=True)


def _status(result: Tracked) -> int:
    """Print the verdict and the advice about the cameras; return the exit status."""
    from zenocap.common.camera_advice import take_lines

    rating = "good" if result.verdict is None else result.verdict.rating
    if result.verdict is not None:
        typer.echo(result.verdict.text, err=rating != "good")
    for line in take_lines(result.advice):
        typer.echo(line, err=True)
    if rating == "unusable" or not result.poses:
        return UNUSABLE
    return LOSS if result.problems or result.left_out or rating == "doubtful" else DONE


def next_commands(take: Path, folder: Path) -> str:
    """What is usually done next with a take, as commands to copy.  folder: that was tracked, which show may not find."""
    name, away = shlex.quote(str(take)), take.absolute().parent not in (folder.absolute(), folder.absolute().parent)
    videos = f" --videos {shlex.quote(str(folder))}" if away and (folder / "calibration.toml").is_file() else ""
    export = f"zenocap export {name} -o {shlex.quote(str(take.with_suffix('.bvh')))}"
    return f"next: zenocap show {name}{videos}\n      {export}"
