"""The table of export formats: what a file of each may have, and what writes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, cast

from zenocap.common.atomic_write import new_file
from zenocap.common.errors import UserError, pip_install
from zenocap.common.table import Table, attribute

if TYPE_CHECKING:  # `zenocap --help` reads the names alone
    from zenocap.common.body.joint_conventions import Convention
    from zenocap.common.formats.bone_names import BoneNames
    from zenocap.common.formats.pose_track import PoseTrack
    from zenocap.common.formats.trajectories import Angle, Axes, Trajectories, Unit

AVERAGE = "average proportions, not measured in a T-pose"


@dataclass(frozen=True)
class ExportRequest:
    """Content of a file.  track: its rows.  axes, unit: of positions and points.  angle: unit of the model's angles.

    joints: convention of the points; those of a limb below min_confidence are missing.  spine: with those of the spine.
    bones: names of the bones.  model: a file that the format needs.  smoothing: description of the filter, "none" without
    one.  take: name of the take's file.  measured: whether the body was; else its proportions are average ones.
    """

    track: PoseTrack
    axes: Axes = "y-up"
    unit: Unit = "m"
    angle: Angle = "deg"
    joints: Convention = "zenocap"
    min_confidence: float = 0.0
    spine: bool = False
    bones: BoneNames = "zenocap"
    model: Path | None = None
    smoothing: str = "none"
    take: str = ""
    measured: bool = True

    def points(self) -> Trajectories:
        return self.track.trajectories(self.joints, self.min_confidence, spine=self.spine)

    @property
    def sizes(self) -> str:
        """Origin of the body's sizes, in words."""
        return "measured in a T-pose" if self.measured else AVERAGE


@dataclass(frozen=True)
class ExportFormat:
    """One format.

    write: "module:function", called with file and `ExportRequest`; returns points that a model lacks, or None.
    suffixes: of its files, the usual one first; none: only with --to.  suffix_decides: whether each is a kind of its own.
    unit: customary one.  units, axes: allowed ones, None: all.  points: whether it has joint centres, of any convention.
    numbered: whether rows have frame numbers or times; else row k is frame k.  confidence: whether uncertain points can be
    left out.  bones: whether its bones have names to choose.  model: the file that it needs, in words; "" for none.
    empty: what a row without pose is, in words.  needs: module, package and extra of zenocap that write it.
    title: in a list to choose from, "" for the name in capitals.
    """

    name: str
    write: str
    suffixes: tuple[str, ...]
    unit: Unit = "m"
    units: tuple[Unit, ...] | None = None
    axes: tuple[Axes, ...] | None = None
    points: bool = False
    numbered: bool = True
    confidence: bool = False
    bones: bool = False
    model: str = ""
    suffix_decides: bool = False
    empty: str = "blank"
    needs: tuple[str, str, str] | None = None
    title: str = ""

    def written(self, output: Path, request: ExportRequest, *, new: bool = False) -> Sequence[str]:
        """Write the file.  new: none is replaced.  Raises UserError for a package that is missing, and OSError."""
        if self.needs is not None and find_spec(self.needs[0]) is None:
            _, package, extra = self.needs
            raise UserError(f"{output}: {self.name} needs the package {package}: {pip_install(extra)}")
        write = cast("Callable[[Path, ExportRequest], Sequence[str] | None]", attribute(self.write))
        if not (new and self.suffixes):  # a folder replaces none but an empty one
            return write(output, request) or ()
        with new_file(output) as unfinished:
            try:
                return write(unfinished, request) or ()
            except UserError as error:
                raise UserError(str(error).replace(str(unfinished), str(output))) from error


TRC = ExportFormat(
    "trc", "zenocap.common.formats.trc:export", (".trc",), points=True, confidence=True, title="TRC: OpenSim, Pose2Sim"
)
BVH = ExportFormat(
    "bvh", "zenocap.common.formats.bvh_writer:export", (".bvh",), "cm", numbered=False, empty="last pose repeated",
    title="BVH: Blender, Unity",
)  # fmt: skip
C3D = ExportFormat(
    "c3d", "zenocap.common.formats.c3d:export", (".c3d",), "mm", points=True, numbered=False, confidence=True
)
CSV = ExportFormat(
    "csv", "zenocap.common.formats.tables:write_csv", (".csv",), points=True, confidence=True, title="CSV: tables"
)
MOT = ExportFormat(
    "mot", "zenocap.common.formats.opensim_coordinates:export_mot", (".mot",), units=("m",), axes=("y-up", "opensim"),
    empty="left out", title="MOT: OpenSim's coordinates",
)  # fmt: skip
PARQUET = ExportFormat(
    "parquet", "zenocap.common.formats.tables:write_parquet", (".parquet",), points=True, confidence=True,
    title="Parquet: pandas, R",
)  # fmt: skip
NPZ = ExportFormat(
    "npz", "zenocap.common.formats.tables:write_npz", (".npz",), points=True, confidence=True, title="NPZ: NumPy"
)
OPENSIM = ExportFormat(
    "opensim", "zenocap.tools.takes.opensim_folder:export", (), units=("m",), axes=("y-up", "opensim"),
    confidence=True, model="an .osim file", empty="left out",
)  # fmt: skip
GLB = ExportFormat(
    "glb", "zenocap.tools.takes.export:export_glb", (".glb", ".vrma"), units=("m",), axes=("y-up",),
    numbered=False, bones=True, empty="last pose repeated", needs=("pygltflib", "pygltflib", "gltf"),
    title="glTF (GLB): Blender, VRM avatars",
)  # fmt: skip
USD = ExportFormat(
    "usd", "zenocap.tools.takes.export:export_usd", (".usd", ".usda", ".usdc", ".usdz"), units=("m",),
    axes=("y-up",), numbered=False, bones=True, suffix_decides=True, empty="last pose repeated, invisible",
    needs=("pxr", "usd-core", "usd"),
)  # fmt: skip

FORMATS = Table(
    ExportFormat,
    "zenocap.formats",
    {
        name: f"{__name__}:{name.upper()}"
        for name in ("trc", "bvh", "c3d", "csv", "mot", "parquet", "npz", "opensim", "glb", "usd")
    },
)


def format_of(suffix: str) -> ExportFormat | None:
    """The format of files with a suffix, such as ".bvh"; None for another one."""
    return FORMATS.first(lambda one: suffix.lower() in one.suffixes)


def names_with(has: Callable[[ExportFormat], bool]) -> tuple[str, ...]:
    """Names of the formats of a kind."""
    return tuple(name for name, one in FORMATS.rows().items() if has(one))
