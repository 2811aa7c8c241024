"""Roles of the joints of a humanoid skeleton by its structure, where the names of the joints are not known.

Legs and arms are the two longest pairs of branches with equal bones at two different joints, pelvis and chest; the legs
point away from the chest.  In a leg, thigh and shank are about equally long and the foot turns off; in an arm, the lengths
fit those of the thigh by the proportions of Drillis and Contini (1966), as in Winter.  Bones in line, such as those of a
twist, count as one.  The sides are those of the names, or, without any, follow from the direction of the feet.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.formats.bvh_reader import END, Bvh

EQUAL = 0.06  # largest difference of the lengths of a left and a right bone, of the limb's length; chosen by hand
MOST_FRAMES = 200  # that directions are the medians of
THIGH, UPPER_ARM, FOREARM = 0.245, 0.186, 0.146  # over body height: Drillis and Contini (1966), as in Winter
ODD = 0.18  # largest cost of a limb, squared natural logarithms of the ratios to these proportions; chosen by hand
BEND = 10.0  # cost of a bent segment, per share by which it is longer than its ends are apart; chosen by hand
LEAST_TURN_DEG = 30.0  # of the foot against the shank; chosen by hand
STUB = 0.1  # cost of an ankle or a wrist that is the end of a bone and no joint; chosen by hand
AWAY, TOWARDS = -0.6, -0.5  # cosine of legs and arms to the line from their joint to the other one; chosen by hand
SIDE = re.compile(r"(?i:left|right)|(?<![A-Za-z])[LRlr](?![a-z])|^[lr](?=[A-Z])|(?<=[a-z0-9])[LR]$")
SAME_JOINT = 0.1  # share of the trunk within which a joint of the face counts as the head; chosen by hand
MOST_CHAIN = 24  # joints of a limb that are searched

Limb = tuple[int, int, int]  # joints: hip, knee, ankle, or shoulder, elbow, wrist


class StructureError(ValueError):
    """The text says what does not fit a human."""


@dataclass(frozen=True)
class _Tree:
    """points: (n, joints, 3) of some frames.  lengths: of the bone to a joint.  reach: of the longest way down from it."""

    names: tuple[str, ...]
    children: tuple[tuple[int, ...], ...]
    points: Floats
    lengths: Floats
    reach: Floats

    def way_down(self, joint: int) -> list[int]:
        """The joint and those on the longest way down from it."""
        way = [joint]
        while self.children[way[-1]]:
            way.append(max(self.children[way[-1]], key=lambda child: self.lengths[child] + self.reach[child]))
        return way

    def below(self, joint: int) -> list[int]:
        """The joint and all below it."""
        found = [joint]
        for one in found:
            found += self.children[one]
        return found

    def direction(self, start: int, end: int) -> Floats:
        """(n, 3) unit vectors; 0 between joints at the same place."""
        line = self.points[:, end] - self.points[:, start]
        return np.asarray(line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9))


@dataclass(frozen=True)
class _Pair:
    """Two equal branches of a joint: ways down, and the shorter one's length."""

    joint: int
    ways: tuple[list[int], list[int]]
    length: float


def roles_by_structure(file: Bvh) -> dict[str, int]:
    """Indices of joints by role, as `bvh_joint_names.roles_of`.  Raises StructureError."""
    tree = _tree(file)
    legs, arms, thigh_shank, upper_forearm = _limbs(tree)
    feet = [_foot(tree, way, limb) for way, limb in zip(legs.ways, thigh_shank, strict=True)]
    left_leg = _left(tree, legs, thigh_shank, feet, arms.joint)
    left_arm = _left_arm(tree, arms, upper_forearm, thigh_shank[left_leg], thigh_shank[1 - left_leg])
    found: dict[str, int] = {"Head": _head(tree, legs, arms)}
    for letter, leg, arm in (("L", left_leg, left_arm), ("R", 1 - left_leg, 1 - left_arm)):
        found |= {f"{letter}{role}": k for role, k in zip(("Hip", "Knee", "Ankle"), thigh_shank[leg], strict=True)}
        found |= {f"{letter}{role}": k for role, k in zip(("Shoulder", "Elbow", "Wrist"), upper_forearm[arm], strict=True)}
        if feet[leg]:
            found[f"{letter}Toe"] = feet[leg][0]
    return found


def _limbs(tree: _Tree) -> tuple[_Pair, _Pair, tuple[Limb, Limb], tuple[Limb, Limb]]:
    """Legs and arms and their joints: the first candidates that fit a human."""
    problem = StructureError("no two pairs of equal branches that could be legs and arms")
    for legs, arms in _candidates(tree):
        try:
            thigh_shank = _fitting(tree, legs, "leg", 0.0)
            thigh = _length(tree, thigh_shank[0][0], thigh_shank[0][1], legs.ways[0])
            return legs, arms, thigh_shank, _fitting(tree, arms, "arm", thigh)
        except StructureError as error:
            problem = error
    raise problem


def _tree(file: Bvh) -> _Tree:
    count = len(file.names)
    children: list[list[int]] = [[] for _ in range(count)]
    points = file.points[:: max(1, len(file.points) // MOST_FRAMES)]
    lengths, reach = np.zeros(count), np.zeros(count)
    for k, parent in enumerate(file.parents):
        if parent >= 0:
            children[parent].append(k)
            lengths[k] = float(np.median(np.linalg.norm(points[:, k] - points[:, parent], axis=1)))
    for k in reversed(range(count)):
        if file.parents[k] >= 0:
            reach[file.parents[k]] = max(reach[file.parents[k]], lengths[k] + reach[k])
    return _Tree(file.names, tuple(map(tuple, children)), points, lengths, reach)


def _candidates(tree: _Tree) -> list[tuple[_Pair, _Pair]]:
    """Pairs that could be legs and arms, the likeliest first.  Raised arms point away from the pelvis, as legs do."""
    likely: list[tuple[_Pair, _Pair]] = []
    possible: list[tuple[_Pair, _Pair]] = []
    pairs = sorted(_pairs(tree), key=lambda pair: -pair.length)
    for one, other in combinations(pairs[:6], 2):
        apart = [set(tree.below(way[0])) for pair in (one, other) for way in pair.ways]
        if one.joint == other.joint or any({one.joint, other.joint} & limb for limb in apart):
            continue
        first, second = _towards(tree, one, other), _towards(tree, other, one)
        if first < AWAY:
            (likely if second > TOWARDS else possible).append((one, other))
        if second < AWAY:
            (likely if first > TOWARDS else possible).append((other, one))
    return [*likely, *possible]


def _pairs(tree: _Tree) -> list[_Pair]:
    """The longest pair of equal branches of every joint that has one."""
    found = []
    for joint, children in enumerate(tree.children):
        best: _Pair | None = None
        for one, other in combinations(children, 2):
            ways = (tree.way_down(one), tree.way_down(other))
            length = min(float(tree.lengths[way].sum()) for way in ways)
            if len(ways[0]) != len(ways[1]) or len(ways[0]) > MOST_CHAIN or length <= 0.0:
                continue
            unequal = float(np.abs(tree.lengths[ways[0]] - tree.lengths[ways[1]]).max())
            if unequal <= EQUAL * length and (best is None or length > best.length):
                best = _Pair(joint, ways, length)
        if best is not None:
            found.append(best)
    return found


def _towards(tree: _Tree, pair: _Pair, other: _Pair) -> float:
    """Median cosine of the limbs of a pair to the line from its joint to the other pair's."""
    line = tree.direction(pair.joint, other.joint)
    cosines = [np.sum(line * tree.direction(pair.joint, way[-1]), axis=1) for way in pair.ways]
    return float(np.median(np.mean(cosines, axis=0)))


def _fitting(tree: _Tree, pair: _Pair, kind: Literal["leg", "arm"], thigh: float) -> tuple[Limb, Limb]:
    """The three joints of both limbs that fit a human best, at the same places of both ways.  thigh: length, for arms."""
    best, chosen = np.inf, (0, 0, 0)
    for places in combinations(range(len(pair.ways[0])), 3):
        costs = [_cost(tree, way, places, kind, thigh) for way in pair.ways]
        if max(costs) < best:
            best, chosen = max(costs), places
    if not best <= ODD:
        said = "thigh and shank of about equal length and a foot" if kind == "leg" else "the proportions of human arms"
        raise StructureError(f"the branches of {tree.names[pair.joint]!r} do not have {said}")
    first, second = ((way[chosen[0]], way[chosen[1]], way[chosen[2]]) for way in pair.ways)
    return first, second


def _cost(tree: _Tree, way: Sequence[int], places: Sequence[int], kind: str, thigh: float) -> float:
    a, b, c = (way[place] for place in places)
    upper, lower = _length(tree, a, b, way), _length(tree, b, c, way)
    if min(upper, lower) <= 0.0:
        return float("inf")
    stub = STUB if tree.names[c].endswith(END) else 0.0
    bent = sum(_length(tree, one, two, way) / max(_apart(tree, one, two), 1e-9) - 1.0 for one, two in ((a, b), (b, c)))
    if kind == "arm":
        ratios = np.log([upper / thigh * THIGH / UPPER_ARM, lower / thigh * THIGH / FOREARM])
        return float(ratios @ ratios + BEND * bent + stub)
    cost = float(np.log(upper / lower) ** 2 + BEND * bent + stub)
    rest = way[places[2] + 1 :]
    if rest and not tree.names[rest[0]].endswith(END) and _turn_deg(tree, b, c, rest[0]) < LEAST_TURN_DEG:
        return float("inf")
    # Of several that fit, the longest limb: a hip and a toe are no foot's joints.
    return cost + 0.2 * float(1.0 - (upper + lower) / tree.lengths[list(way[1:])].sum())


def _foot(tree: _Tree, way: Sequence[int], limb: Limb) -> Sequence[int]:
    """The joint after the ankle, or nothing where there is none, or only the end of a stub in line with the shank."""
    return [k for k in way[way.index(limb[2]) + 1 :][:1] if _turn_deg(tree, limb[1], limb[2], k) >= LEAST_TURN_DEG]


def _turn_deg(tree: _Tree, one: int, two: int, three: int) -> float:
    """Median angle in degrees between two bones that follow each other; 0 where the second one has no length."""
    if _apart(tree, two, three) <= 0.0:
        return 0.0
    cosines = np.sum(tree.direction(one, two) * tree.direction(two, three), axis=1)
    return float(np.degrees(np.arccos(np.clip(np.median(cosines), -1.0, 1.0))))


def _length(tree: _Tree, start: int, end: int, way: Sequence[int]) -> float:
    """Length of the way between two of its joints."""
    return float(tree.lengths[list(way[way.index(start) + 1 : way.index(end) + 1])].sum())


def _apart(tree: _Tree, one: int, other: int) -> float:
    return float(np.median(np.linalg.norm(tree.points[:, one] - tree.points[:, other], axis=1)))


def _left(tree: _Tree, legs: _Pair, limbs: tuple[Limb, Limb], feet: Sequence[Sequence[int]], chest: int) -> int:
    """Which of the two legs is the left one, 0 or 1."""
    named = _named_left(tree, legs.ways)
    if named is not None:
        return named
    if not all(feet):
        raise StructureError("neither names nor feet tell left from right")
    front = sum(tree.direction(limb[2], foot[0]) for limb, foot in zip(limbs, feet, strict=True))
    left = np.cross(tree.direction(legs.joint, chest), front)
    across = tree.points[:, limbs[0][0]] - tree.points[:, limbs[1][0]]
    return 0 if float(np.median(np.sum(across * left, axis=1))) > 0.0 else 1


def _left_arm(tree: _Tree, arms: _Pair, limbs: tuple[Limb, Limb], left: Limb, right: Limb) -> int:
    """Which of the two arms is the left one, by names, or else on the side of the left hip."""
    named = _named_left(tree, arms.ways)
    if named is not None:
        return named
    across = tree.points[:, left[0]] - tree.points[:, right[0]]
    arm = tree.points[:, limbs[0][0]] - tree.points[:, limbs[1][0]]
    return 0 if float(np.median(np.sum(across * arm, axis=1))) > 0.0 else 1


def _named_left(tree: _Tree, ways: Sequence[Sequence[int]]) -> int | None:
    """Which of two limbs the names of its joints call left; None where they do not say."""
    votes = []
    for way in ways:
        sides = [side_of(tree.names[joint]) for joint in way]
        votes.append(sides.count("L") - sides.count("R"))
    if votes[0] == votes[1]:
        return None
    return 0 if votes[0] > votes[1] else 1


def side_of(name: str) -> Literal["L", "R", ""]:
    """Side that a joint's name contains: left, right, or a letter of its own."""
    found = SIDE.search(name)
    if found is None:
        return ""
    return "L" if found[0][0] in "lL" else "R"


def _head(tree: _Tree, legs: _Pair, arms: _Pair) -> int:
    """The head: on the way from the arms' joint that goes up farthest and is neither an arm nor holds the legs."""
    ways = [tree.way_down(child) for child in tree.children[arms.joint] if child not in {way[0] for way in arms.ways}]
    ways = [way for way in ways if legs.joint not in tree.below(way[0])]
    if not ways:
        raise StructureError(f"nothing between the arms of {tree.names[arms.joint]!r} could be the head")
    up = tree.direction(legs.joint, arms.joint)

    def height(way: Sequence[int]) -> float:
        return float(np.median(np.sum((tree.points[:, way[-1]] - tree.points[:, arms.joint]) * up, axis=1)))

    way = [joint for joint in max(ways, key=height) if not tree.names[joint].endswith(END)]
    if not way or height(way) < 0.0:
        raise StructureError(f"nothing above {tree.names[arms.joint]!r} could be the head")
    named = [joint for joint in way if "head" in tree.names[joint].lower()]
    branching = [joint for joint in way if len(tree.children[joint]) > 1]
    if named or not branching:
        return (named or way[-1:])[0]
    least = SAME_JOINT * float(np.median(np.linalg.norm(tree.points[:, arms.joint] - tree.points[:, legs.joint], axis=1)))
    at = way.index(branching[0])
    while at > 0 and tree.lengths[way[at]] < least:  # a joint of the face at the place of the head's
        at -= 1
    return way[at]
