"""The table of live outputs of the animator, and the part of a rig file that each has."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import (
    HEAD_ALIGNMENTS,
    TRACKERS,
    FoxgloveTable,
    LslTable,
    OutputTable,
    RosTable,
    UdpTable,
    VmcTable,
    VrchatTable,
)
from zenocap.common.rig.table_errors import choice_problem, invalid_value, unknown_key
from zenocap.common.table import Table

ROS_NAME = r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*"


def _no_problem(table: object) -> None:
    return None


@dataclass(frozen=True)
class OutputKind:
    """name: of its table within `[animator]`.  table: its type, with a default for every key.

    open: "module:function" or class, called with table, name of the rig, clock; gives an `Output`.  Raises OutputError.
    problem: text for a value of the table that is not allowed, which begins with its key; None without one.
    """

    name: str
    table: type[OutputTable]
    open: str
    problem: Callable[[OutputTable], str | None] = _no_problem


def _vrchat_problem(table: OutputTable) -> str | None:
    assert isinstance(table, VrchatTable)
    for number, name in enumerate(table.trackers):
        if name not in TRACKERS:
            return choice_problem(f"trackers[{number}]", name, TRACKERS)
        if name in table.trackers[:number]:
            return f"trackers[{number}] = {name!r}: allowed: each name once"
    if table.head not in HEAD_ALIGNMENTS:
        return choice_problem("head", table.head, HEAD_ALIGNMENTS)
    return None


def _ros_problem(table: OutputTable) -> str | None:
    assert isinstance(table, RosTable)
    if not re.fullmatch(r"[a-z][a-z\-]*/[^\s\"]+", table.connect):
        return f"connect = {table.connect!r}: allowed: PROTOCOL/ADDRESS, such as tcp/192.168.1.2:7447"
    if table.namespace and not re.fullmatch(rf"/?{ROS_NAME}(/{ROS_NAME})*", table.namespace):
        return f"namespace = {table.namespace!r}: allowed: letters, digits and single '_', such as lab or lab/studio"
    if not re.fullmatch(rf"{ROS_NAME}(/{ROS_NAME})*", table.frame):
        return f"frame = {table.frame!r}: allowed: letters, digits and single '_', such as map"
    return None


HOME = "zenocap.services.animator.outputs"
VMC = OutputKind("vmc", VmcTable, f"{HOME}.vmc:opened")
VRCHAT = OutputKind("vrchat", VrchatTable, f"{HOME}.vrchat:opened", _vrchat_problem)
UDP = OutputKind("udp", UdpTable, f"{HOME}.udp:opened")
FOXGLOVE = OutputKind("foxglove", FoxgloveTable, f"{HOME}.foxglove:opened")
LSL = OutputKind("lsl", LslTable, f"{HOME}.lsl:LslOutput")
ROS = OutputKind("ros", RosTable, f"{HOME}.ros:RosOutput", _ros_problem)

OUTPUTS = Table(
    OutputKind,
    "zenocap.outputs",
    {name: f"{__name__}:{name.upper()}" for name in ("vmc", "vrchat", "udp", "foxglove", "lsl", "ros")},
)


def outputs_in(path: Path, animator: Mapping[str, object]) -> dict[str, OutputTable]:
    """The outputs in the `[animator]` table of the rig file at `path`, in the order of the table.  Raises UserError."""
    found = {}
    for name in OUTPUTS.names():
        if name not in animator:
            continue
        kind, key, given = OUTPUTS.row(name), f"animator.{name}", animator[name]
        problem = unknown_key(key, given, kind.table)
        if problem is None:
            try:
                found[name] = msgspec.convert(given, kind.table)
                problem = kind.problem(found[name])
                problem = problem and f"{key}.{problem}"
            except msgspec.ValidationError as error:
                values = given if isinstance(given, dict) else {}
                problem = invalid_value(values, str(error), key) if values else f"{key} = {given!r}: allowed: a table"
        if problem is not None:
            raise UserError(f"{path}: {problem}")
    return found
