"""The command that compares a take with ground truth, with another system or another take: evaluate."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.frame_range import FrameRange
from zenocap.tools.cli.options import DONE, LOSS, JsonOption, RawOption, TakePath, checked_take, one_line_errors
from zenocap.tools.cli.progress import progress

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.trajectories import Trajectories
    from zenocap.tools.recordings.evaluate import Accuracy

SAME_RATE = 0.02  # relative difference up to which two durations are equal; chosen by hand
CENTRES = (".trc", ".c3d", ".bvh", ".mcap")  # suffixes of files with joint centres; the first one's are compared by default
ANGLES = (".mot", ".bvh", ".trc", ".c3d", ".mcap")


def evaluate(
    take: TakePath,
    truth: Annotated[
        Path,
        typer.Option(
            metavar="FILE",
            help="Ground truth: joint centres or markers (.trc, .c3d), skeleton (.bvh), OpenSim coordinates (.mot), or a "
            "take (.mcap).",
            show_default=False,
        ),
    ],
    every: Annotated[int, typer.Option(min=1, help="Score every Nth frame, for a take at 1/N of the truth's rate.")] = 1,
    offset: Annotated[int, typer.Option(help="Frame number of the take minus that of the truth.")] = 0,
    angles: Annotated[
        bool | None,
        typer.Option(
            "--angles/--centres",
            help="Compare joint angles, or joint centres; default: centres for .trc, angles for the others.",
            show_default=False,
        ),
    ] = None,
    joints: Annotated[
        Literal["zenocap", "halpe"],
        typer.Option(help="Convention of the truth's joint centres: halpe for those of Pose2Sim, see docs/conventions.md."),
    ] = "zenocap",
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the angles over time (PNG, JPG, PDF, SVG).", show_default=False),
    ] = None,
    raw: RawOption = False,
    as_json: JsonOption = False,
    *,
    span: FrameRange,
) -> None:
    """Measure the error of a take's joint centres or joint angles against ground truth, or compare two takes.

    Joint centres: mpjpe_mm, rmse_mm and median_mm are distances (mm) over all joints of all frames. shape_mm is the RMS
    distance without each joint's constant offset in the person's pelvis frame, because two bodies do not define their
    joints alike. lost_pct is the share of joints without estimate or more than 250 mm away.

    Joint angles (degrees): mean absolute error, RMS, bias (mean of take minus truth), RMS without the bias, ranges of
    motion, correlation. Frames are paired by time, within half a frame interval. Definitions: docs/conventions.md.

    --from and --until are frames of the truth. --raw applies to the take alone, not to a truth that is a take: `zenocap
    evaluate walk.mcap --raw --truth walk.mcap` shows what the second pass changed.

    Example: `zenocap evaluate walk.mcap --truth clips/walk/truth.trc --from 99`
    """
    first, last = span.bounds()
    suffix = truth.suffix.lower()
    use_angles = suffix != CENTRES[0] if angles is None else angles
    if plot is not None and not use_angles:
        raise typer.BadParameter(f"--plot {plot}: draws joint angles: allowed: with --angles, or a truth of another format")
    if joints != "zenocap" and (use_angles or suffix == ".mcap"):
        raise typer.BadParameter(
            f"--joints {joints}: convention of joint centres: allowed: with a .trc or --centres of a .bvh"
        )
    with one_line_errors(), progress(f"reading {take}"):
        from zenocap.common.errors import UserError
        from zenocap.common.formats.import_format import import_suffixes
        from zenocap.common.formats.take_poses import read_poses, summary_of
        from zenocap.tools.recordings.evaluate import ScoredFrames, accuracy

        allowed = dict.fromkeys((*(ANGLES if use_angles else CENTRES), *import_suffixes()))
        if suffix not in allowed:
            quantity = "joint angles" if use_angles else "joint centres"
            raise UserError(f"--truth {truth}: suffix {truth.suffix!r}: allowed for {quantity}: {', '.join(allowed)}")
        if plot is not None:
            from zenocap.tools.recordings.angle_report import check_picture

            check_picture(plot)
        poses = read_poses(checked_take(take), raw=raw)
        selection = ScoredFrames(first, last, every, offset)
        if use_angles:
            from zenocap.tools.recordings.angle_report import angle_lines
            from zenocap.tools.recordings.evaluate_angles import angle_accuracy

            found, curves = angle_accuracy(poses.track(), truth, selection, take)
            if plot is not None:
                from zenocap.tools.recordings.angle_report import draw_angles

                draw_angles(plot, curves, found, (truth.name, take.name))
            result, lines = asdict(found), angle_lines(found)
        else:
            from zenocap.common.formats.motion_files import read_centres

            track, centres = poses.trajectories(joints), read_centres(truth)
            scored = accuracy(track, centres, selection)
            if note := pairing_note(track, centres, every, offset):
                typer.echo(f"note: {note}", err=True)
            result, lines = asdict(scored), _centre_lines(scored)
        cuts = [cut for cut in (poses.cut, summary_of(truth).cut if suffix == ".mcap" else None) if cut]
    for line in [json.dumps(result)] if as_json else lines:
        typer.echo(line)
    for cut in cuts:
        typer.echo(f"lost: {cut}", err=True)
    raise typer.Exit(LOSS if cuts else DONE)


def pairing_note(take: Trajectories, truth: Trajectories, every: int, offset: int) -> str:
    """What is wrong with joint centres that are paired by frame number; empty where nothing is.

    every: step in frames of the truth.  offset: frame number of the take minus that of the truth.
    """
    import numpy as np

    shared = sorted({int(frame) - offset for frame in take.frames} & {int(frame) for frame in truth.frames})
    if len(shared) < 2:
        return ""
    ends = [int(np.searchsorted(truth.frames, frame)) for frame in (shared[0], shared[-1])]
    own = [int(np.searchsorted(take.frames, frame + offset)) for frame in (shared[0], shared[-1])]
    truth_s, take_s = np.diff(truth.times_s[ends]).item(), np.diff(take.times_s[own]).item()
    if abs(take_s - truth_s) > SAME_RATE * truth_s:
        return (
            f"frames {shared[0]} to {shared[-1]} last {take_s:.2f} s in the take and {truth_s:.2f} s in the truth: frames "
            "of equal numbers are compared, so these figures mean nothing; use a truth of the same rate, or --angles"
        )
    step = int(np.median(np.diff(take.frames)))
    if step > every:
        return f"the take has every {step}. frame of the truth, and the others count as lost: give --every {step}"
    return ""


def _centre_lines(found: Accuracy) -> list[str]:
    lines = [f"{name:10} {getattr(found, name)}" for name in ("frames", "joints")]
    for name in ("mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
        lines.append(f"{name:10} {getattr(found, name):.2f}")
    per_joint = "  ".join(f"{name} {value:.0f}" for name, value in found.per_joint_mm.items())
    return [*lines, f"joints mm  {per_joint}"]
