"""`zenocap export`: poses of a take as TRC, BVH, C3D, CSV, Parquet, NPZ, MOT, glTF or USD, or as a set-up for OpenSim."""

from dataclasses import dataclass
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from typing import Literal

import numpy as np

from zenocap.common.body.joint_conventions import CONVENTIONS, SPINE, TITLES, Convention, left_out, origin_of, points_of
from zenocap.common.errors import UserError
from zenocap.common.formats.bone_names import BoneNames
from zenocap.common.formats.csv import Angle, write_csv
from zenocap.common.formats.mot import write_mot
from zenocap.common.formats.opensim_coordinates import FRAMES, coordinates_of
from zenocap.common.formats.pose_track import Bound, PoseTrack, between, every_frame
from zenocap.common.formats.resampling import resampled
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Axes, Trajectories, Unit
from zenocap.common.formats.trc import write_trc
from zenocap.tools.recordings.suffixes import format_name

Format = Literal["trc", "bvh", "c3d", "csv", "mot", "parquet", "npz", "opensim", "glb", "usd"]
UNITS: dict[Format, Unit] = {  # customary units
    "trc": "m", "bvh": "cm", "c3d": "mm", "csv": "m", "mot": "m", "parquet": "m", "npz": "m", "opensim": "m", "glb": "m",
    "usd": "m",
}  # fmt: skip
WITH_POINTS: tuple[Format, ...] = ("trc", "c3d", "csv", "parquet", "npz")  # the others have segments and no points
# Rows have frame numbers or times; in the others row k is frame k.
NUMBERED: tuple[Format, ...] = ("trc", "csv", "mot", "parquet", "npz", "opensim")

SCENES: tuple[Format, ...] = ("glb", "usd")  # skeleton, skin, animation; the files state axes and unit
PACKAGES: dict[Format, tuple[str, str, str]] = {  # module, package and extra of zenocap
    "glb": ("pygltflib", "pygltflib", "gltf"), "usd": ("pxr", "usd-core", "usd"),
}  # fmt: skip


@dataclass(frozen=True)
class ExportOptions:
    """Export options.  first, last: inclusive range.  fps: rate to resample to.  unit: None for the customary.

    joints: convention of the points.  min_confidence: see `PoseTrack.trajectories`.
    smooth: cut-off frequency (Hz) of `smoothed`; None for the poses as they are.
    raw: poses of the forward pass also where the take was tracked both ways.  bones: names of the bones in SCENES.
    model: generic model (.osim) that a set-up of OpenSim scales.  spine: with the joints of the spine, see `points_of`.
    """

    to: Format
    first: Bound | None = None
    last: Bound | None = None
    fps: float | None = None
    axes: Axes = "y-up"
    unit: Unit | None = None
    angle: Angle = "deg"
    joints: Convention = "zenocap"
    smooth: float | None = None
    raw: bool = False
    min_confidence: float = 0.0
    bones: BoneNames = "zenocap"
    model: Path | None = None
    spine: bool = False


@dataclass(frozen=True)
class Exported:
    """Result of an export.  first, last: frame numbers.  empty: rows without pose (BVH, SCENES: last pose repeated).

    cut: description of missing content of the take, None when it is complete.  left_out: points of the joint convention
    that the take's body does not have.  unsmoothed: stretches and frames that the filter left, because they are short.
    """

    rows: int
    first: int
    last: int
    rate: float
    unit: Unit
    empty: int
    cut: str | None
    left_out: tuple[str, ...] = ()
    unsmoothed: tuple[int, int] = (0, 0)


def export(take: Path, output: Path, options: ExportOptions) -> Exported:
    """Write the poses of `take` to `output`, replaced by the complete file or not at all.  Raises UserError."""
    if options.joints not in CONVENTIONS:
        raise UserError(f"{output}: joints {options.joints!r}: allowed: {', '.join(CONVENTIONS)}")
    if options.joints != "zenocap" and options.to not in WITH_POINTS:
        allowed = ", ".join(WITH_POINTS)
        raise UserError(f"{output}: joints {options.joints}: {options.to} has no points: allowed in {allowed}")
    if options.spine and options.to not in WITH_POINTS:
        raise UserError(f"{output}: spine: {options.to} has no points: allowed in {', '.join(WITH_POINTS)}")
    if (options.model is not None) != (options.to == "opensim"):
        allowed = "an .osim file with --to opensim, and only there"
        raise UserError(f"{output}: model {options.model or 'not given'}: allowed: {allowed}")
    if options.min_confidence and options.to not in (*WITH_POINTS, "opensim"):
        allowed = ", ".join(WITH_POINTS)
        raise UserError(f"{output}: min confidence: {options.to} has no points to leave out: allowed in {allowed}")
    poses = read_poses(take, raw=options.raw)
    whole = poses.track()
    if options.min_confidence and not whole.limbs:
        raise UserError(f"{take}: min confidence: the take states none: allowed with takes of the tracker of this version")
    filtered, unsmoothed = "none", (0, 0)
    if options.smooth is not None:
        from zenocap.common.formats.smoothing import description, smoothed, too_short

        raw, whole = whole, smoothed(whole, options.smooth)
        unsmoothed = too_short(raw, options.smooth)
        filtered = description(options.smooth, unsmoothed)
    track = selected(whole, options)
    unit = options.unit or UNITS[options.to]
    _check(output, track, options, unit)
    try:
        lacking = _write(output, track, options, unit, filtered, take)
    except OSError as error:
        raise UserError(f"{output}: cannot be written: {error.strerror or error}") from error
    empty = int(np.count_nonzero(~track.known))
    first, last = int(track.frames[0]), int(track.frames[-1])
    missing = (*left_out(options.joints, track.anatomy, spine=options.spine), *lacking)
    return Exported(len(track.frames), first, last, track.rate, unit, empty, poses.cut, missing, unsmoothed)


def selected(take: PoseTrack, options: ExportOptions) -> PoseTrack:
    """Rows to write: the selected part, resampled, and without gaps in formats whose rows have no numbers."""
    track = between(take, options.first, options.last)
    if options.fps:
        track = resampled(track, options.fps)
    if options.to in NUMBERED:
        return track
    first = 0
    if options.first is not None:
        start_s = options.first.value if options.first.seconds else options.first.value / (take.rate or 1.0)
        first = min(max(0, ceil(start_s * track.rate - 1e-6)), int(track.frames[0]))
    return every_frame(track, first)


def _check(output: Path, track: PoseTrack, options: ExportOptions, unit: Unit) -> None:
    """Raise UserError for what OpenSim cannot read: another unit, an axis other than Y up, or a file without rows."""
    if options.bones != "zenocap" and options.to not in SCENES:
        raise UserError(f"{output}: bones {options.bones}: allowed in {', '.join(SCENES)}")
    if options.to in SCENES and (unit != UNITS[options.to] or options.axes != "y-up"):
        raise UserError(f"{output}: units {unit}, axes {options.axes}: allowed in {options.to}: m, y-up; importers convert")
    if options.to == "usd" and format_name(output.suffix) != "usd":
        raise UserError(f"{output}: suffix {output.suffix!r}: allowed in usd: .usd, .usda, .usdc, .usdz")
    if options.to == "opensim":
        if unit != UNITS["opensim"] or options.axes not in FRAMES:
            raise UserError(
                f"{output}: axes {options.axes}, units {unit}: allowed with --to opensim: none, it has OpenSim's"
            )
        return
    if options.to != "mot":
        return
    if unit != UNITS["mot"]:
        raise UserError(f"{output}: units {unit}: allowed in mot: {UNITS['mot']}")
    if options.axes not in FRAMES:
        raise UserError(f"{output}: axes {options.axes}: allowed in mot: {', '.join(FRAMES)}")
    if not track.known.any():
        raise UserError(f"{output}: the person is lost in every frame: no row to write")


def _write(
    output: Path, track: PoseTrack, options: ExportOptions, unit: Unit, smoothing: str, take: Path
) -> tuple[str, ...]:
    """Write the file; return points that a model lacks."""
    match options.to:
        case "opensim":
            from zenocap.tools.recordings.opensim_folder import write_opensim

            assert options.model is not None
            return write_opensim(
                output, track, options.model, take=take.name, smoothing=smoothing, min_confidence=options.min_confidence
            )
        case "trc":
            write_trc(output, _points(track, options), axes=options.axes, unit=unit)
        case "csv":
            write_csv(
                output, track, axes=options.axes, unit=unit, angle=options.angle, joints=options.joints,
                min_confidence=options.min_confidence, spine=options.spine,
            )  # fmt: skip
        case "mot":
            notes = [] if smoothing == "none" else [f"Smoothing: {smoothing}.", ""]
            write_mot(output, *coordinates_of(track, options.axes), notes)
        case "parquet" | "npz":
            from zenocap.common.formats.tables import TableLayout, write_npz, write_parquet

            layout = TableLayout(
                options.axes, unit, options.angle, options.joints, options.min_confidence, smoothing, options.spine
            )
            (write_parquet if options.to == "parquet" else write_npz)(output, track, layout)
        case "bvh":
            from zenocap.common.formats.bvh_writer import write_bvh

            write_bvh(output, track, axes=options.axes, unit=unit)
        case "glb" | "usd":
            _write_scene(output, track, options)
        case "c3d":
            from zenocap.common.formats.c3d import write_c3d

            write_c3d(
                output,
                _points(track, options),
                axes=options.axes,
                unit=unit,
                descriptions=_descriptions(track, options),
                smoothing=smoothing,
            )
    return ()


def _write_scene(output: Path, track: PoseTrack, options: ExportOptions) -> None:
    module, package, extra = PACKAGES[options.to]
    if find_spec(module) is None:
        raise UserError(f"{output}: {options.to} needs the package {package}: pip install 'zenocap[{extra}]'")
    from zenocap.common.formats.animated_skeleton import animated_skeleton
    from zenocap.services.animator.render.skin import skin_of

    motion = animated_skeleton(track, skin_of(track.anatomy, track.bdp), options.bones)
    if options.to == "glb":
        from zenocap.common.formats.gltf import write_glb

        write_glb(output, motion, output.stem)
    else:
        from zenocap.common.formats.usd import write_usd

        write_usd(output, motion, output.stem)


def _points(track: PoseTrack, options: ExportOptions) -> Trajectories:
    return track.trajectories(options.joints, options.min_confidence, spine=options.spine)


def _descriptions(track: PoseTrack, options: ExportOptions) -> list[str]:
    """Of every point: its convention, and whether it is measured; empty for the default of `write_c3d`."""
    if options.joints == "zenocap" and not options.spine:
        return []
    title = TITLES[options.joints]
    points = points_of(options.joints, track.anatomy, spine=options.spine)
    return [f"{'spine' if p in SPINE else title} {p.name}, {origin_of(p, track.anatomy)}" for p in points]
