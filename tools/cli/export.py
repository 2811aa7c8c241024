"""The command that writes the poses of a take for other programs: export."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.formats.export_format import AVERAGE, FORMATS, ExportFormat, format_of
from zenocap.tools.cli.options import (
    DONE,
    LOSS,
    FrameRange,
    RawOption,
    RemoteOption,
    TakePath,
    checked_take,
    one_line_errors,
    smoothing,
)
from zenocap.tools.cli.progress import progress
from zenocap.tools.cli.suggestions import WrongArgument
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.takes.export import Exported, ExportOptions

OFF_ROWS = 1.5  # from its own time to its row at one rate, from which it is said: live cameras jitter less; chosen by hand

ExportOutput = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="File to write; default: beside the take, with its name, in the format of --to or bvh.",
    ),
]


@dataclass(frozen=True)
class ExportArguments:
    """to: name of a format.  fps: rate to resample to."""

    to: str | None = option(
        None,
        "Format; default: by the name of the output. trc, c3d: joint centres. bvh: animated skeleton. "
        "csv, parquet, npz: joint angles, scores and joint centres. mot: OpenSim's coordinates. "
        "opensim: a folder that scales --model and finds its motion. glb, usd: body, skeleton, animation. "
        "Installed packages may bring others.",
        metavar="|".join(FORMATS.own),
    )
    fps: float | None = option(
        None,
        "Resample to this rate (frames per second, FPS), at multiples of its period; default: the frames of the take. "
        "Positions are interpolated linearly, joints along the shortest rotation; gaps of more than 0.25 s stay empty.",
        min=0.1,
        max=1000,
    )
    axes: Literal["y-up", "z-up", "ros", "opensim", "unity", "unreal"] = option(
        "y-up",
        "World axes. y-up: as recorded, the person first faces Z. z-up: Blender, FreeMoCap; facing -Y. ros: Z up, facing "
        "X. opensim: Y up, facing X. unity: left-handed, Y up, facing Z. unreal: left-handed, Z up, facing X.",
    )
    units: Literal["m", "cm", "mm"] | None = option(None, "Unit of length; default: m, but cm in bvh and mm in c3d.")


@dataclass(frozen=True)
class ExportExpert:
    """What the rows hold, and how they are filtered."""

    angles: Literal["deg", "rad"] = option("deg", "Unit of the joint angles in csv, parquet and npz.")
    joints: Literal["zenocap", "isb", "coco", "halpe"] = option(
        "zenocap",
        "Convention of the joint centres. zenocap: 15 centres of the model's joints. halpe: HALPE-26, with heels, toes and "
        "face, where Pose2Sim has them on its OpenSim model. coco: COCO-17, the same places. isb: 12 joint centres as the "
        "ISB defines them. Heels and toes need the tracker's body; that of two-view has no feet. Some points are derived: "
        "docs, conventions.",
    )
    spine: bool = option(
        False,
        "Add the joints between hips and head to any --joints in trc, c3d, csv, parquet and npz: Pelvis, Thorax, and with "
        "the tracker's body Spine and UpperNeck.",
    )
    bones: Literal["zenocap", "vrm"] = option(
        "zenocap",
        "Names of the bones in glb and usd. zenocap: Hips, LeftArm ... as in bvh. vrm: hips, leftUpperArm ... of VRM 1.0.",
    )
    smooth: str = option(
        "off",
        "Cut-off frequency of a Butterworth filter (Hz), before all else; or off. 6 removes what is faster than 6 Hz, "
        "usual for walking (order 4, forwards and backwards: no delay). Gaps stay. Poses in the take are never smoothed.",
        metavar="HZ|off",
    )
    model: Path | None = option(
        None, "With --to opensim: generic model to scale, such as Rajagopal's.", metavar="MODEL.osim"
    )
    raw: RawOption = False
    min_confidence: float = option(
        0.0,
        "Leave out points of a limb whose confidence is less; of trc, c3d, tables and opensim. 0.5: what is rather wrong "
        "than right: the tracker states for each limb the probability that it is within 150 mm (csv has it in columns of "
        "its own). Points of unknown confidence stay. A take of two-view has none and is refused.",
        min=0,
        max=1,
    )
    remote: RemoteOption = False


def export(
    take: TakePath, output: ExportOutput = None, *, given: ExportArguments, span: FrameRange,
    expert: Annotated[ExportExpert, EXPERT],
) -> None:  # fmt: skip
    """Export a take for Blender, Unity, OpenSim and others.

    Writes its poses as BVH, glTF, USD, TRC, C3D, CSV, Parquet, NPZ or MOT. An existing output that is named is replaced,
    by the complete file or not at all. (--to is the format, so the end of a range is --until.)

    trc: OpenSim and Pose2Sim, HALPE names. c3d: the same points. bvh: Blender, Unity and others, rest pose is the T-pose.
    csv, parquet (needs the extra tables), npz: one row per frame; the last two name axes, joints and smoothing
    too. mot: OpenSim's coordinates, degrees; usually with --axes opensim. Frame k of a video is frame k
    of every file: in bvh, glb, usd and c3d, rows count from frame 0, or from --from. Rows are blank while the person is
    lost; bvh, glb and usd repeat the last pose (usd hides the body), mot leaves the row out.

    glb (glTF 2.0, also .vrma for VRM avatars), usd (.usd, .usda, .usdc, .usdz): metres, Y up.

    opensim: a folder with the set-ups of OpenSim's Scale and Inverse Kinematics tools, the model, and a README on how to
    run them; docs, into-opensim.

    Example: `zenocap export walk.mcap -o walk.bvh --fps 30 --from 2s`
    """
    new, output = output is None, output or beside(take, given.to)
    with one_line_errors(), progress(f"exporting {take}", remote=expert.remote):
        from zenocap.tools.takes.export import export as run_export

        form = chosen_format(output, given.to)
        written = run_export(checked_take(take), output, _options(form, given, span, expert), new=new)
    axes = "opensim" if form.model else given.axes
    typer.echo(
        f"{output}: {written.rows} frames, {written.first} to {written.last}, {written.rate:.5g}/s, {written.unit}, {axes}"
    )
    for note in notes_of(form, written):
        typer.echo(f"note: {note}", err=True)
    if written.cut:
        typer.echo(f"lost: {written.cut}", err=True)
    raise typer.Exit(LOSS if written.cut else DONE)


def _options(form: ExportFormat, given: ExportArguments, span: FrameRange, expert: ExportExpert) -> ExportOptions:
    """Raises typer.BadParameter."""
    from zenocap.tools.takes.export import ExportOptions

    first, last = span.bounds()
    cutoff_hz = smoothing("--smooth", expert.smooth)
    return ExportOptions(
        form.name, first, last, given.fps, given.axes, given.units, expert.angles, expert.joints, cutoff_hz, expert.raw,
        expert.min_confidence, expert.bones, expert.model, expert.spine,
    )  # fmt: skip


def notes_of(form: ExportFormat, written: Exported) -> Iterator[str]:
    """What a file lacks, and what is odd about the videos of its take, in words."""
    from zenocap.common.runtime.foreign_text import printable

    for viewer, note in written.video_notes.items():
        yield f"video of viewer {printable(viewer)}: {printable(note)}"
    if not written.measured:
        yield f"the body has {AVERAGE}: lengths may be some centimetres off"
    if written.empty:
        yield f"{written.empty} frames without pose: {form.empty}"
    if written.left_out:
        lacking = "the model has no arms" if form.model else f"the take's body has {missing_parts(written.left_out)}"
        yield f"{lacking}: left out: {', '.join(written.left_out)}"
    if written.off_s * written.rate > OFF_ROWS:
        yield (
            f"the times are uneven, and {form.name} has one rate: rows are up to {written.off_s:.2f} s from theirs; "
            f"`zenocap export TAKE --fps {round(written.rate)}` puts them at even times"
        )
    if written.unsmoothed[0]:
        stretches, frames = written.unsmoothed
        yield f"too short to smooth, unchanged: stretches {stretches}, frames {frames}"


def beside(take: Path, to: str | None) -> Path:
    """Output beside a take that has its name: walk.bvh, or for a format without suffix the folder walk-opensim.

    Raises typer.BadParameter for an unknown format, and where there is one: what is not named is not replaced.
    """
    suffixes = (".bvh",) if to is None else chosen_format(take, to).suffixes
    found = take.with_suffix(suffixes[0]) if suffixes else take.with_name(f"{take.stem}-{to}")
    if found.exists():
        raise typer.BadParameter(f"{found} is there already: allowed: -o FILE, which may replace it")
    return found


def chosen_format(output: Path, to: str | None) -> ExportFormat:
    """The format of that name, or else of the output's suffix.  Raises typer.BadParameter, WrongArgument."""
    if to is not None:
        if to not in FORMATS.names():
            raise typer.BadParameter(f"--to {to!r}: allowed: {', '.join(FORMATS.names())}")
        return FORMATS.row(to)
    found = format_of(output.suffix)
    if found is None:
        allowed = ", ".join(suffix for one in FORMATS.rows().values() for suffix in one.suffixes)
        raise WrongArgument(f"--output {output}: allowed: a name ending in {allowed}, or any with --to")
    return found


def missing_parts(names: tuple[str, ...]) -> str:
    """What a body lacks that has no points of these names."""
    from zenocap.common.body.joint_conventions import SPINE

    of_spine = {point.name for point in SPINE} & set(names)
    return " and ".join(
        [*(["no feet"] if len(names) > len(of_spine) else []), *(["no joint in the spine"] if of_spine else [])]
    )
