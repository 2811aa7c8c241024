"""The command that compares a take with ground truth, with another system or another take: evaluate."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import (
    DONE,
    LOSS,
    FrameRange,
    JsonOption,
    RawOption,
    TakePath,
    check_plot,
    checked_take,
    one_line_errors,
)
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.take_poses import TakePoses
    from zenocap.tools.takes.evaluate import ScoredFrames

CENTRES = ".trc"  # suffix of files whose joint centres are compared by default; of others, joint angles


@dataclass(frozen=True)
class EvaluateArguments:
    """truth: file to compare with.  every, offset: frames that are paired.  angles: None as usual for the truth."""

    truth: Annotated[
        Path,
        typer.Option(
            metavar="FILE",
            help="Ground truth: joint centres or markers (.trc, .c3d), skeleton (.bvh), OpenSim coordinates (.mot), or a "
            "take (.mcap).",
        ),
    ]
    every: int = option(1, "Score every Nth frame, for a take at 1/N of the truth's rate.", min=1)
    offset: int = option(0, "Frame number of the take minus that of the truth.")
    angles: bool | None = option(
        None,
        "Compare joint angles, or joint centres; default: centres for .trc, angles for the others.",
        "--angles/--centres",
    )
    joints: Literal["zenocap", "halpe"] = option(
        "zenocap", "Convention of the truth's joint centres: halpe for those of Pose2Sim, see docs/conventions.md."
    )
    plot: Path | None = option(None, "Draw the angles over time (.png, .jpg, .pdf, .svg).", metavar="FILE")
    raw: RawOption = False
    as_json: JsonOption = False

    def use_angles(self) -> bool:
        """Whether joint angles are compared.  Raises typer.BadParameter for options that do not fit."""
        suffix = self.truth.suffix.lower()
        found = suffix != CENTRES if self.angles is None else self.angles
        if self.plot is not None and not found:
            raise typer.BadParameter(
                f"--plot {self.plot}: draws joint angles: allowed: with --angles, or a truth of another format"
            )
        if self.joints != "zenocap" and (found or suffix == ".mcap"):
            raise typer.BadParameter(
                f"--joints {self.joints}: convention of joint centres: allowed: with a .trc or --centres of a .bvh"
            )
        return found


def evaluate(take: TakePath, *, given: EvaluateArguments, span: FrameRange) -> None:
    """Measure the error of a take, or compare two takes.

    Its joint centres or joint angles are compared with ground truth, another system, or another take. Joint centres:
    mpjpe_mm, rmse_mm and median_mm are distances (mm) over all joints of all frames. shape_mm is the RMS distance
    without each joint's constant offset in the person's pelvis frame, because two bodies do not define their joints
    alike. lost_pct is the share of joints without estimate or more than 250 mm away.

    Joint angles (degrees): mean absolute error, RMS, bias (mean of take minus truth), RMS without the bias, ranges of
    motion, correlation. Definitions: docs/conventions.md.

    Frames are paired by time, within half a frame interval, also where the numbers of both sides differ. Exit status 3:
    compared, but doubtful, because another offset, exchanged sides or another unit leave less than half of the error (the
    first line of the output; `doubts` of --json); or a take is cut.

    --from and --until are frames of the truth. --raw applies to the take alone, not to a truth that is a take: `zenocap
    evaluate walk.mcap --raw --truth walk.mcap` shows what the second pass changed.

    Example: `zenocap evaluate walk.mcap --truth clips/walk/truth.trc --from 99`
    """
    first, last = span.bounds()
    use_angles = given.use_angles()
    with one_line_errors(), progress(f"reading {take}"):
        from zenocap.common.formats.take_poses import read_poses, summary_of
        from zenocap.tools.takes.evaluate import ScoredFrames, check_truth

        check_truth(given.truth, angles=use_angles)
        check_plot(given.plot)
        poses = read_poses(checked_take(take), raw=given.raw)
        selection = ScoredFrames(first, last, given.every, given.offset)
        result, doubts, lines = (_angles if use_angles else _centres)(poses, take, given, selection)
        cuts = [poses.cut, summary_of(given.truth).cut if given.truth.suffix.lower() == ".mcap" else None]
    for line in (
        [json.dumps(result | {"doubts": doubts})] if given.as_json else [*(f"doubtful: {one}" for one in doubts), *lines]
    ):
        typer.echo(line)
    for cut in filter(None, cuts):
        typer.echo(f"lost: {cut}", err=True)
    raise typer.Exit(LOSS if doubts or any(cuts) else DONE)


def _angles(
    poses: TakePoses, take: Path, given: EvaluateArguments, selection: ScoredFrames
) -> tuple[dict[str, object], list[str], list[str]]:
    """Errors of joint angles for programs, doubts about them, and lines; drawn on request.  Raises UserError."""
    from zenocap.tools.takes.evaluate_angles import angle_accuracy, angle_lines, draw_angles

    found, curves = angle_accuracy(poses.track(), given.truth, selection, take)
    if given.plot is not None:
        draw_angles(given.plot, curves, found, (given.truth.name, take.name))
    return asdict(found), list(found.doubts), angle_lines(found)


def _centres(
    poses: TakePoses, take: Path, given: EvaluateArguments, selection: ScoredFrames
) -> tuple[dict[str, object], list[str], list[str]]:
    """Errors of joint centres for programs, doubts about them, and lines for people.  Raises UserError."""
    from zenocap.common.formats.angle_series import filled
    from zenocap.common.formats.motion_files import read_centres
    from zenocap.tools.takes.evaluate import BAD_LOST_PCT, BAD_MM, accuracy, centre_lines, doubts, pairing_notes

    track, centres = filled(poses.track()).trajectories(given.joints), read_centres(given.truth)
    found = accuracy(track, centres, selection)
    estimated = poses.trajectories(given.joints)
    for note in pairing_notes(estimated, centres, selection):
        typer.echo(f"note: {note}", err=True)
    bad = found.mpjpe_mm > BAD_MM or found.lost_pct > BAD_LOST_PCT
    doubted = doubts(estimated, centres, selection, found.mpjpe_mm) if bad else []
    return asdict(found), doubted, centre_lines(found)
