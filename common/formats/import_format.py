"""The table of import formats: files of motion that others have recorded, as joint centres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

from zenocap.common.table import Table, attribute

if TYPE_CHECKING:
    from zenocap.common.formats.joint_map import JointMap
    from zenocap.common.formats.trajectories import Trajectories


@dataclass(frozen=True)
class ImportFormat:
    """One format.  suffixes: of its files.

    read: "module:function", called with a path and a `JointMap` or None; returns joint centres (HALPE names, Y up, metres):
    `named_centres` finds them among the points of a file.  Raises UserError.
    """

    name: str
    suffixes: tuple[str, ...]
    read: str

    def centres(self, path: Path, joints: JointMap | None) -> Trajectories:
        """Read a file.  Raises UserError."""
        return cast("Callable[[Path, JointMap | None], Trajectories]", attribute(self.read))(path, joints)


HOME = "zenocap.common.formats.motion_files"
BVH = ImportFormat("bvh", (".bvh",), "zenocap.common.formats.bvh_joint_names:read_bvh_centres")
TRC = ImportFormat("trc", (".trc",), f"{HOME}:trc_centres")
C3D = ImportFormat("c3d", (".c3d",), f"{HOME}:c3d_centres")

IMPORTS = Table(ImportFormat, "zenocap.imports", {name: f"{__name__}:{name.upper()}" for name in ("bvh", "trc", "c3d")})


def import_format_of(path: Path) -> ImportFormat | None:
    """The format of a file by its suffix; None for another one."""
    return IMPORTS.first(lambda one: path.suffix.lower() in one.suffixes)


def import_suffixes() -> tuple[str, ...]:
    """Suffixes of the formats of zenocap and of installed packages."""
    return tuple(suffix for one in IMPORTS.rows().values() for suffix in one.suffixes)
