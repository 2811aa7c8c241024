"""BVH reader: hierarchy and positions of all joints in every frame, in the file's axes and unit."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.errors import UserError
from zenocap.common.formats.text_file import read_text

INTEGER_RATE = 5e-4  # relative deviation of a rate from an integer that is rounding of the frame time; chosen by hand
MAX_NUMBERS = 200_000_000  # in memory, 1.6 GB: half an hour of 75 joints at 120 Hz; chosen by hand
NUMBERS_OF_JOINT = 12  # position and rotation of a joint in a frame
END = " end"  # suffix of the name of an End Site, after its joint's name


@dataclass(frozen=True)
class Bvh:
    """names: of the joints, parents first; an End Site is `JOINT end`.  parents: by joint, -1 for the root.

    points: (n, joints, 3) and rotations: (n, joints, 3, 3), joint to world, in the file's axes and unit.
    rate: frames per second.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    points: Floats
    rotations: Floats
    rate: float


@dataclass
class _Joint:
    name: str
    parent: int
    offset: tuple[float, float, float] | None = None
    channels: list[str] = field(default_factory=list)


class _Lines:
    """Iterator over the words of the lines of a file that are not blank."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self._lines = [(k, words) for k, line in enumerate(text.splitlines(), start=1) if (words := line.split())]
        self._next = 0

    def take(self, expected: str) -> list[str]:
        """Return the words of the next line.  expected: for the UserError at the end of the file."""
        if self._next >= len(self._lines):
            raise UserError(f"{self.path}: ends before {expected}")
        self._next += 1
        return self._lines[self._next - 1][1]

    def rest(self) -> list[tuple[int, list[str]]]:
        return self._lines[self._next :]

    def error(self, allowed: str) -> UserError:
        number, words = self._lines[self._next - 1]
        return UserError(f"{self.path}: line {number}: {' '.join(words)[:40]!r}: allowed: {allowed}")


def read_bvh(path: Path) -> Bvh:
    """Read a BVH file.  Position channels of any joint replace its OFFSET.  Raises UserError."""
    lines = _Lines(path, read_text(path, "a BVH file"))
    if lines.take("HIERARCHY")[0].upper() != "HIERARCHY":
        raise lines.error("HIERARCHY, the first line of a BVH file")
    joints = _hierarchy(lines)
    rate, values = _motion(lines, sum(len(joint.channels) for joint in joints))
    if (numbers := NUMBERS_OF_JOINT * len(joints) * len(values)) > MAX_NUMBERS:  # a joint need not have channels
        found = f"{len(joints)} joints in {len(values)} frames, {numbers} numbers"
        raise UserError(f"{path}: {found}: allowed: {MAX_NUMBERS}; split the file")
    points = np.zeros((len(values), len(joints), 3))
    rotations = np.zeros((len(values), len(joints), 3, 3))
    first = 0
    for k, joint in enumerate(joints):
        own = values[:, first : first + len(joint.channels)]
        first += len(joint.channels)
        place = np.tile(np.array(joint.offset), (len(values), 1))
        turns = [column for column, channel in enumerate(joint.channels) if channel.endswith("rotation")]
        for column, channel in enumerate(joint.channels):
            if channel.endswith("position"):
                place[:, "xyz".index(channel[0])] = own[:, column]
        turn = euler_to_matrix("".join(joint.channels[column][0] for column in turns), np.radians(own[:, turns]))
        if joint.parent < 0:
            points[:, k], rotations[:, k] = place, turn
        else:
            points[:, k] = points[:, joint.parent] + np.einsum("nij,nj->ni", rotations[:, joint.parent], place)
            rotations[:, k] = rotations[:, joint.parent] @ turn
    return Bvh(tuple(j.name for j in joints), tuple(j.parent for j in joints), points, rotations, rate)


def _hierarchy(lines: _Lines) -> list[_Joint]:
    """Read joints and End Sites up to the brace that closes the root."""
    joints: list[_Joint] = []
    open_joints: list[int] = []
    while True:
        word, *rest = lines.take("the rest of the HIERARCHY" if joints else "ROOT")
        opens = bool(rest) and rest[-1] == "{"
        rest = rest[:-1] if opens else rest
        match word.upper():
            case "ROOT" | "JOINT" | "END":
                if (word.upper() == "ROOT") != (not joints) or not rest or (joints and not open_joints):
                    raise lines.error("one ROOT NAME, then JOINT NAME and End Site inside it")
                parent = open_joints[-1] if open_joints else -1
                name = joints[parent].name + END if word.upper() == "END" else " ".join(rest)
                joints.append(_Joint(name, parent))
                if not opens and lines.take("{") != ["{"]:
                    raise lines.error("{")
                open_joints.append(len(joints) - 1)
            case "OFFSET" if open_joints:
                joints[open_joints[-1]].offset = _offset(lines, rest)
            case "CHANNELS" if open_joints:
                joints[open_joints[-1]].channels = _channels(lines, rest)
            case "}" if open_joints:
                if joints[open_joints[-1]].offset is None:
                    raise lines.error(f"an OFFSET of {joints[open_joints[-1]].name} before it")
                open_joints.pop()
                if not open_joints:
                    return joints
            case _:
                raise lines.error("JOINT, End Site, OFFSET, CHANNELS or } in the HIERARCHY")


def _offset(lines: _Lines, words: list[str]) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words)
    except ValueError:
        raise lines.error("OFFSET and three numbers") from None
    return x, y, z


def _channels(lines: _Lines, words: list[str]) -> list[str]:
    count, names = words[0] if words else "", [word.lower() for word in words[1:]]
    good = all(name[:1] in "xyz" and name[1:] in ("position", "rotation") for name in names)
    turns = [name for name in names if name.endswith("rotation")]
    if count != str(len(names)) or not good or len(set(names)) != len(names) or len(turns) > 3:
        raise lines.error("CHANNELS, their number, and as many of Xposition ... Zrotation, each once")
    return names


def _motion(lines: _Lines, channels: int) -> tuple[float, Floats]:
    """Read the frame rate (1/s) and the values (n, channels)."""
    if lines.take("MOTION")[0].upper() != "MOTION":
        raise lines.error("MOTION after the HIERARCHY")
    count = lines.take("Frames:")
    if len(count) != 2 or count[0].lower() != "frames:" or not count[1].isdecimal() or int(count[1]) < 1:
        raise lines.error("Frames: and a number from 1")
    step = lines.take("Frame Time:")
    try:
        rate = 1.0 / float(step[2]) if [word.lower() for word in step[:2]] == ["frame", "time:"] else 0.0
    except (ValueError, IndexError, ZeroDivisionError):
        rate = 0.0
    if not 0.1 < rate < 1e5:
        raise lines.error("Frame Time: and the frame period, up to 10 s")
    rows = lines.rest()
    if len(rows) != int(count[1]):
        raise UserError(f"{lines.path}: Frames: {count[1]}, but there are {len(rows)} rows of numbers: allowed: as many")
    values = np.empty((len(rows), channels))
    for k, (number, words) in enumerate(rows):
        try:
            values[k] = np.array(words, dtype=np.float64)
        except ValueError:
            allowed = f"{channels} numbers, one for each channel of the HIERARCHY"
            raise UserError(f"{lines.path}: line {number}: {len(words)} cells: allowed: {allowed}") from None
        if not np.isfinite(values[k]).all():
            raise UserError(f"{lines.path}: line {number}: not all numbers are finite")
    return float(round(rate)) if abs(rate - round(rate)) < INTEGER_RATE * rate else rate, values
