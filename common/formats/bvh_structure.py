"""Roles of the joints of a humanoid skeleton by its structure.

Legs and arms are the two longest pairs of branches with equal bones at two different joints, pelvis and chest; the legs
point away from the chest.  In a leg, thigh and shank are about equally long and the foot turns off.  In an arm, the lengths
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
from zenocap.common.formats.bvh_tree import Tree, tree_of

EQUAL = 0.06  # largest difference of the lengths of a left and a right bone, of the limb's length; chosen by hand
THIGH, UPPER_ARM, FOREARM = 0.245, 0.186, 0.146  # over body height: Drillis and Contini (1966), as in Winter
ODD = 0.18  # largest cost of a limb, squared natural logarithms of the ratios to these proportions; chosen by hand
BEND = 10.0  # cost of a bent segment, per relative excess of its length over its ends' distance; chosen by hand
LEAST_TURN_DEG = 30.0  # of the foot against the shank; chosen by hand
STUB = 0.1  # cost of an ankle or a wrist that is the end of a bone and no joint; chosen by hand
AWAY, TOWARDS = -0.6, -0.5  # cosine of legs and arms to the line from their joint to the other one; chosen by hand
SIDE = re.compile(r"(?i:left|right)|(?<![A-Za-z])[LRlr](?![a-z])|^[lr](?=[A-Z])|(?<=[a-z0-9])[LR]$")
SAME_JOINT = 0.1  # share of the trunk within which a joint of the face counts as the head; chosen by hand
MOST_CHAIN = 24  # joints of a limb that are searched
MOST_BRANCHES = 8  # of a joint, the longest, that may be limbs; chosen by hand
MOST_PAIRS = 6  # the longest, that may be legs and arms; chosen by hand
LEG, ARM = ("Hip", "Knee", "Ankle"), ("Shoulder", "Elbow", "Wrist")

Limb = tuple[int, int, int]  # joints: hip, knee, ankle, or shoulder, elbow, wrist


class StructureError(ValueError):
    """Text: the parts that do not fit a human."""


@dataclass(frozen=True)
class _Pair:
    """Two equal branches of a joint: ways down, and the shorter one's length."""

    joint: int
    ways: tuple[list[int], list[int]]
    length: float


@dataclass(frozen=True)
class _Limbs:
    """Legs and arms, and their three joints each."""

    legs: _Pair
    arms: _Pair
    leg_joints: tuple[Limb, Limb]
    arm_joints: tuple[Limb, Limb]


def roles_by_structure(file: Bvh) -> dict[str, int]:
    """Indices of joints by role, as `bvh_joint_names.roles_of`.  Raises StructureError."""
    tree = tree_of(file)
    limbs = _limbs(tree)
    feet = [_foot(tree, way, limb) for way, limb in zip(limbs.legs.ways, limbs.leg_joints, strict=True)]
    beside = np.sum(_across(tree, limbs.leg_joints) * _across(tree, limbs.arm_joints), axis=1)
    crossed = float(np.median(beside)) < 0.0
    left_leg = _left_leg(tree, limbs, feet, crossed)
    found: dict[str, int] = {"Head": _head(tree, limbs.legs, limbs.arms)}
    for letter, leg in (("L", left_leg), ("R", 1 - left_leg)):
        arm = leg != crossed  # as a number, 0 or 1
        found |= {f"{letter}{role}": k for role, k in zip(LEG, limbs.leg_joints[leg], strict=True)}
        found |= {f"{letter}{role}": k for role, k in zip(ARM, limbs.arm_joints[arm], strict=True)}
        if feet[leg]:
            found[f"{letter}Toe"] = feet[leg][0]
    return found


def _limbs(tree: Tree) -> _Limbs:
    """The first candidates for legs and arms that fit a human."""
    problem = StructureError("no two pairs of equal branches that could be legs and arms")
    for legs, arms in _candidates(tree):
        try:
            thigh_shank = _fitting(tree, legs, "leg", 0.0)
            thigh = tree.along(thigh_shank[0][0], thigh_shank[0][1], legs.ways[0])
            return _Limbs(legs, arms, thigh_shank, _fitting(tree, arms, "arm", thigh))
        except StructureError as error:
            problem = error
    raise problem


def _candidates(tree: Tree) -> list[tuple[_Pair, _Pair]]:
    """Pairs that could be legs and arms, the likeliest first.  Raised arms point away from the pelvis, as legs do."""
    likely: list[tuple[_Pair, _Pair]] = []
    possible: list[tuple[_Pair, _Pair]] = []
    pairs = sorted(_pairs(tree), key=lambda pair: -pair.length)
    for one, other in combinations(pairs[:MOST_PAIRS], 2):
        apart = [set(tree.below(way[0])) for pair in (one, other) for way in pair.ways]
        if one.joint == other.joint or any({one.joint, other.joint} & limb for limb in apart):
            continue
        first, second = _towards(tree, one, other), _towards(tree, other, one)
        if first < AWAY:
            (likely if second > TOWARDS else possible).append((one, other))
        if second < AWAY:
            (likely if first > TOWARDS else possible).append((other, one))
    return [*likely, *possible]


def _pairs(tree: Tree) -> list[_Pair]:
    """The longest pair of equal branches of every joint that has one."""
    found = []
    for joint, children in enumerate(tree.children):
        best: _Pair | None = None
        longest = sorted(children, key=lambda child: -(tree.lengths[child] + tree.reach[child]))[:MOST_BRANCHES]
        for one, other in combinations((child for child in longest if tree.steps[child] < MOST_CHAIN), 2):
            ways = (tree.way_down(one), tree.way_down(other))
            length = min(float(tree.lengths[way].sum()) for way in ways)
            if len(ways[0]) != len(ways[1]) or length <= 0.0:
                continue
            unequal = float(np.abs(tree.lengths[ways[0]] - tree.lengths[ways[1]]).max())
            if unequal <= EQUAL * length and (best is None or length > best.length):
                best = _Pair(joint, ways, length)
        if best is not None:
            found.append(best)
    return found


def _towards(tree: Tree, pair: _Pair, other: _Pair) -> float:
    """Median cosine of the limbs of a pair to the line from its joint to the other pair's."""
    line = tree.direction(pair.joint, other.joint)
    cosines = [np.sum(line * tree.direction(pair.joint, way[-1]), axis=1) for way in pair.ways]
    return float(np.median(np.mean(cosines, axis=0)))


def _fitting(tree: Tree, pair: _Pair, kind: Literal["leg", "arm"], thigh: float) -> tuple[Limb, Limb]:
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


def _cost(tree: Tree, way: Sequence[int], places: Sequence[int], kind: str, thigh: float) -> float:
    a, b, c = (way[place] for place in places)
    upper, lower = tree.along(a, b, way), tree.along(b, c, way)
    if min(upper, lower) <= 0.0:
        return float("inf")
    stub = STUB if tree.names[c].endswith(END) else 0.0
    bent = sum(tree.along(one, two, way) / max(tree.apart(one, two), 1e-9) - 1.0 for one, two in ((a, b), (b, c)))
    if kind == "arm":
        ratios = np.log([upper / thigh * THIGH / UPPER_ARM, lower / thigh * THIGH / FOREARM])
        return float(ratios @ ratios + BEND * bent + stub)
    cost = float(np.log(upper / lower) ** 2 + BEND * bent + stub)
    rest = way[places[2] + 1 :]
    if rest and not tree.names[rest[0]].endswith(END) and tree.turn_deg(b, c, rest[0]) < LEAST_TURN_DEG:
        return float("inf")
    # Of several that fit, the longest limb: a hip and a toe are no foot's joints.
    return cost + 0.2 * float(1.0 - (upper + lower) / tree.lengths[list(way[1:])].sum())


def _foot(tree: Tree, way: Sequence[int], limb: Limb) -> Sequence[int]:
    """The joint after the ankle, or nothing where there is none, or only the end of a stub in line with the shank."""
    return [k for k in way[way.index(limb[2]) + 1 :][:1] if tree.turn_deg(limb[1], limb[2], k) >= LEAST_TURN_DEG]


def _left_leg(tree: Tree, limbs: _Limbs, feet: Sequence[Sequence[int]], crossed: bool) -> int:
    """Index of the left leg, 0 or 1: by the names of legs and arms, without these by the feet.

    crossed: the first arm is on the side of the second leg.
    """
    leg, arm = (_named_left(tree, pair.ways) for pair in (limbs.legs, limbs.arms))
    beside_arm = None if arm is None else int(arm != crossed)
    if leg is not None and beside_arm not in (None, leg):
        raise StructureError("the names of arms and legs call opposite sides left")
    named = beside_arm if leg is None else leg
    if named is not None:
        return named
    if not all(feet):
        raise StructureError("neither names nor feet tell left from right")
    front = sum(tree.direction(leg[2], foot[0]) for leg, foot in zip(limbs.leg_joints, feet, strict=True))
    left = np.cross(tree.direction(limbs.legs.joint, limbs.arms.joint), front)
    return 0 if float(np.median(np.sum(_across(tree, limbs.leg_joints) * left, axis=1))) > 0.0 else 1


def _across(tree: Tree, limbs: tuple[Limb, Limb]) -> Floats:
    """(n, 3) from the first joint of the second limb to that of the first one: of hips or shoulders."""
    return np.asarray(tree.points[:, limbs[0][0]] - tree.points[:, limbs[1][0]])


def _named_left(tree: Tree, ways: Sequence[Sequence[int]]) -> int | None:
    """Index of the limb that its joints' names call left; None without such a name."""
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


def _head(tree: Tree, legs: _Pair, arms: _Pair) -> int:
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
    least = SAME_JOINT * tree.apart(arms.joint, legs.joint)
    at = way.index(branching[0])
    while at > 0 and tree.lengths[way[at]] < least:  # a joint of the face at the place of the head's
        at -= 1
    return way[at]
