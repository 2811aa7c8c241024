"""`zenocap export`: poses of a take as files of other programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, left_out
from zenocap.common.body.kinematics import part_frames
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.errors import UserError
from zenocap.common.formats.animated_skeleton import AnimatedSkeleton, Skin, animated_skeleton
from zenocap.common.formats.bone_names import BoneNames
from zenocap.common.formats.export_format import FORMATS, ExportFormat, ExportRequest, names_with
from zenocap.common.formats.pose_track import Bound, PoseTrack, between, every_frame
from zenocap.common.formats.resampling import resampled
from zenocap.common.formats.skeleton import skeleton_of
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Angle, Axes, Unit
from zenocap.tools.takes.render.surfaces import HEAD, LEFT, MIDDLE, RIGHT, VISOR, body_surface, posed_surface
from zenocap.tools.takes.render.theme import THEMES, linear

MATERIALS = {MIDDLE: "torso", LEFT: "left", RIGHT: "right", HEAD: "head", VISOR: "visor"}  # by shade of the body surface


@dataclass(frozen=True)
class ExportOptions:
    """Export options.  to: name of a format.  first, last: inclusive range.  fps: rate to resample to.

    unit: None for the customary.

    joints: convention of the points.  min_confidence: see `PoseTrack.trajectories`.
    smooth: cut-off frequency (Hz) of `smoothed`; None for the poses as they are.
    raw: poses of the forward pass also where the take was tracked both ways.  bones: names of the bones in SCENES.
    model: generic model (.osim) that a set-up of OpenSim scales.  spine: with the joints of the spine, see `points_of`.
    """

    to: str
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
    off_s: farthest row from its own time, seconds, in a format with one rate.  measured: whether the body was, in a T-pose.
    video_notes: by viewer, see `VideoSummary`.
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
    off_s: float = 0.0
    measured: bool = True
    video_notes: Mapping[str, str] = field(default_factory=dict)


def export(take: Path, output: Path, options: ExportOptions, *, new: bool = False) -> Exported:
    """Write the poses of `take` to `output`, replaced by the complete file or not at all.  new: no file is replaced.

    Raises UserError.
    """
    if options.joints not in CONVENTIONS:
        raise UserError(f"{output}: joints {options.joints!r}: allowed: {', '.join(CONVENTIONS)}")
    to = FORMATS.row(options.to)
    _check(output, to, options)
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
    unit = options.unit or to.unit
    request = ExportRequest(
        track, options.axes, unit, options.angle, options.joints, options.min_confidence, options.spine, options.bones,
        options.model, filtered, take.name, poses.measured,
    )  # fmt: skip
    try:
        lacking = to.written(output, request, new=new)
    except OSError as error:
        if new and isinstance(error, FileExistsError):
            raise UserError(f"{output} is there since a moment ago: allowed: -o FILE, which may replace it") from error
        raise UserError(f"{output}: cannot be written: {error.strerror or error}") from error
    empty = int(np.count_nonzero(~track.known))
    first, last = int(track.frames[0]), int(track.frames[-1])
    missing = (*left_out(options.joints, track.anatomy, spine=options.spine), *lacking)
    off_s = 0.0 if to.numbered else _off_s(track)
    return Exported(
        len(track.frames), first, last, track.rate, unit, empty, poses.cut, missing, unsmoothed, off_s, poses.measured,
        poses.video_notes,
    )  # fmt: skip


def selected(take: PoseTrack, options: ExportOptions) -> PoseTrack:
    """Rows to write: the selected part, resampled, a row for each frame; where rows have no numbers, from frame 0."""
    track = between(take, options.first, options.last)
    if options.fps:
        track = resampled(track, options.fps)
    if FORMATS.row(options.to).numbered:  # live takes leave frames out
        return every_frame(track, int(track.frames[0]))
    first = 0
    if options.first is not None:
        start_s = options.first.value if options.first.seconds else options.first.value / (take.rate or 1.0)
        first = min(max(0, ceil(start_s * track.rate - 1e-6)), int(track.frames[0]))
    return every_frame(track, first)


def _off_s(track: PoseTrack) -> float:
    """Farthest distance of a row's time from that of its number at the mean rate, seconds."""
    counted = track.times_s[0] + np.arange(len(track.frames)) / (track.rate or 1.0)
    return float(np.abs(track.times_s - counted).max())


def _check(output: Path, to: ExportFormat, options: ExportOptions) -> None:
    """Raise UserError for an option that a format does not have."""

    def without_points(what: str, allowed: Sequence[str]) -> UserError:
        return UserError(f"{output}: {what}: allowed in {', '.join(allowed)}")

    with_points = names_with(lambda one: one.points)
    if options.joints != "zenocap" and not to.points:
        raise without_points(f"joints {options.joints}: {to.name} has no points", with_points)
    if options.spine and not to.points:
        raise without_points(f"spine: {to.name} has no points", with_points)
    if options.min_confidence and not to.confidence:
        raise without_points(f"min confidence: {to.name} has no points to leave out", with_points)
    if options.bones != "zenocap" and not to.bones:
        raise without_points(f"bones {options.bones}", names_with(lambda one: one.bones))
    if (options.model is not None) != bool(to.model):
        with_model = [one for one in FORMATS.rows().values() if one.model]
        allowed = f"{' or '.join(f'{one.model} with --to {one.name}' for one in with_model)}, and only there"
        raise UserError(f"{output}: model {options.model or 'not given'}: allowed: {allowed}")
    unit = options.unit or to.unit
    if unit not in (to.units or (unit,)) or options.axes not in (to.axes or (options.axes,)):
        units, axes = ", ".join(to.units or ("any",)), ", ".join(to.axes or ("any",))
        raise UserError(f"{output}: units {unit}, axes {options.axes}: allowed in {to.name}: units {units}, axes {axes}")
    if to.suffix_decides and output.suffix.lower() not in to.suffixes:
        raise UserError(f"{output}: suffix {output.suffix!r}: allowed in {to.name}: {', '.join(to.suffixes)}")


def export_glb(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`: body, skeleton and animation."""
    from zenocap.common.formats.gltf import write_glb

    write_glb(path, _motion(request), path.stem)


def export_usd(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`: body, skeleton and animation."""
    from zenocap.common.formats.usd import write_usd

    write_usd(path, _motion(request), path.stem)


def _motion(request: ExportRequest) -> AnimatedSkeleton:
    return animated_skeleton(request.track, skin_of(request.track.anatomy, request.track.bdp), request.bones)


def skin_of(anatomy: Anatomy, bdp: Bdp) -> Skin:
    """The body surface in the skeleton's rest pose; the points of a part move with the first bone of that part."""
    skeleton = skeleton_of(anatomy, bdp)
    body = body_surface(anatomy, bdp)
    rest = part_frames(anatomy, bdp, Pose(np.zeros(3), t_pose_angles(anatomy)))
    surface = posed_surface(body, rest)
    first = {part: skeleton.parts.tolist().index(part) for part in set(skeleton.parts.tolist())}
    root = rest[skeleton.parts[0], :, 3]
    colours = np.array([linear(colour)[::-1] for colour in THEMES["light"].body])[list(MATERIALS)]
    return Skin(
        points=surface.points - root, normals=surface.normals, triangles=surface.triangles,
        bones=np.array([first[part] for part in body.parts.tolist()]),
        materials=np.array([list(MATERIALS).index(shade) for shade in surface.shades[surface.triangles[:, 0]].tolist()]),
        colours=colours, names=tuple(MATERIALS.values()),
    )  # fmt: skip
