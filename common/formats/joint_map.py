"""Joint maps: TOML files that name unrecognized joints or markers of a file.

    up = "z"                        # axis that points up in .trc and .c3d; default: found from the posture

    [joints]                        # joint of zenocap = name in the file
    RHip = "thigh_right"
    RKnee = ["knee_med", "knee_lat"]  # of .trc and .c3d: the middle of several markers

Joints that are not in the map are taken as without a map.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from zenocap.common.body.inverse_kinematics import NEEDED
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml

Up = Literal["x", "y", "z"]
UPS: tuple[Up, ...] = get_args(Up)
JOINTS = ("Head", *NEEDED, "RToe", "LToe")
KEYS = ("up", "joints")
MOST_MARKERS = 8  # of one joint; chosen by hand
NAMES_SHOWN = 60  # of a file, in errors


@dataclass(frozen=True)
class JointMap:
    """Names of joints or markers by joint, one of JOINTS; several: their middle.  up: axis of the file; None: not given.

    path: of the map, for errors.
    """

    path: Path
    joints: Mapping[str, tuple[str, ...]]
    up: Up | None = None

    def check(self, path: Path, names: Sequence[str]) -> None:
        """Raise UserError for a name that a file, at `path`, does not have."""
        for joint, wanted in self.joints.items():
            for name in wanted:
                if name not in names:
                    raise UserError(f"{self.path}: joints.{joint} = {name!r}: allowed: a name in {path}: {listed(names)}")


def listed(names: Sequence[str]) -> str:
    """The first NAMES_SHOWN of the names of a file."""
    return ", ".join(names[:NAMES_SHOWN]) + (", ..." if len(names) > NAMES_SHOWN else "")


def read_joint_map(path: Path) -> JointMap:
    """Read a joint map.  Raises UserError: unknown keys and joints, values of another type, one name for two joints."""
    content = read_toml(path)
    if unknown := [key for key in content if key not in KEYS]:
        raise UserError(f"{path}: {unknown[0]}: allowed: {', '.join(KEYS)}")
    table, up = content.get("joints"), content.get("up")
    if not isinstance(table, dict) or not table:
        raise UserError(f'{path}: joints = {table!r}: allowed: a table [joints] with a line such as RHip = "name"')
    chosen = next((axis for axis in UPS if axis == up), None)
    if up is not None and chosen is None:
        raise UserError(f"{path}: up = {up!r}: allowed: {', '.join(map(repr, UPS))}")
    joints = {joint: _names(path, joint, value) for joint, value in table.items()}
    first: dict[str, str] = {}
    for joint, names in joints.items():
        for name in names:
            if (other := first.setdefault(name, joint)) != joint:
                raise UserError(f"{path}: joints.{joint} = {name!r}: it is joints.{other} too: allowed: each name once")
    return JointMap(path, joints, chosen)


def _names(path: Path, joint: str, value: object) -> tuple[str, ...]:
    if joint not in JOINTS:
        raise UserError(f"{path}: joints.{joint}: allowed: {', '.join(JOINTS)}")
    names = tuple(value) if isinstance(value, list) else (value,)
    texts = tuple(name for name in names if isinstance(name, str) and name)
    if len(texts) != len(names) or not 1 <= len(names) <= MOST_MARKERS or len(set(texts)) < len(texts):
        allowed = f"a name, or a list of up to {MOST_MARKERS} different names"
        raise UserError(f"{path}: joints.{joint} = {value!r}: allowed: {allowed}")
    return texts
