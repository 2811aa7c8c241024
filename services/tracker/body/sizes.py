"""Sizes of a body as factors on an average one, with their spread over people."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy, without_side
from zenocap.common.body.definition import Bdp

LENGTH, LONG, SHORT = 0, 1, 2  # columns of Bdp.sizes; of Bdp.tips 0 long, 1 short
X, Y, Z = 0, 1, 2
SIZES, TIPS, BASES, OFFSETS = 0, 1, 2, 3


@dataclass(frozen=True)
class Factor:
    """Factor on sizes.  spread: standard deviation of its logarithm over people.

    entries: values that it multiplies: array, part (for OFFSETS joint) without its side, column.
    """

    name: str
    spread: float
    entries: tuple[tuple[int, str, int], ...]


def _radii(*entries: tuple[int, str]) -> tuple[tuple[int, str, int], ...]:
    """Entries of both radii of near ends (SIZES) and far ends (TIPS)."""
    columns = {SIZES: (LONG, SHORT), TIPS: (0, 1)}
    return tuple((array, part, column) for array, part in entries for column in columns[array])


def _girth(name: str, spread: float, *entries: tuple[int, str]) -> Factor:
    return Factor(name, spread, _radii(*entries))


# Spreads of lengths and positions of joints: standard deviation of the logarithm of a measure over stature in ANSUR II
# (Gordon et al. 2014; 1986 women and 4082 men, both with equal weight): spine 0.054 (acromial less trochanterion height),
# shoulders 0.057 (biacromial breadth less 0.028 statures), hips 0.074 (bicristal breadth), leg 0.033 (trochanterion less
# malleolus height) and the thigh's share of it 0.033, foot 0.036, skull 0.060 (tragion to top of head).  Arms have 0.029 in
# the survey, and the upper arm's share 0.024; here more, because a fist or a sleeve changes their length in a silhouette.
# So do clothing and hair with breadths and girths, which have 0.05 to 0.14 in the survey.
STATURE = Factor("stature", 0.15, ())
FACTORS = (
    Factor("spine", 0.054, (
        (SIZES, "pelvis", LENGTH), (SIZES, "chest", LENGTH), (OFFSETS, "waist", Y), (OFFSETS, "neck_base", Y),
        (OFFSETS, "shoulder", Y),
    )),
    Factor("shoulders", 0.057, ((OFFSETS, "shoulder", X),)),
    Factor("hips", 0.074, ((OFFSETS, "hip", X),)),
    Factor("arm", 0.08, ((SIZES, "upper_arm", LENGTH), (SIZES, "lower_arm", LENGTH), (OFFSETS, "elbow", Y))),
    Factor("upper_arm", 0.05, ((SIZES, "upper_arm", LENGTH), (OFFSETS, "elbow", Y))),
    Factor("leg", 0.033, (
        (SIZES, "upper_leg", LENGTH), (SIZES, "lower_leg", LENGTH), (OFFSETS, "knee", Y), (OFFSETS, "ankle", Y),
    )),
    Factor("thigh", 0.033, ((SIZES, "upper_leg", LENGTH), (OFFSETS, "knee", Y))),
    Factor("neck", 0.15, ((SIZES, "neck_column", LENGTH), (OFFSETS, "neck", Y))),
    Factor("skull", 0.06, ((SIZES, "head", LENGTH), (BASES, "head", Y))),
    Factor("foot", 0.036, ((SIZES, "foot", LENGTH), (BASES, "foot", Y))),
    Factor("sole", 0.15, ((BASES, "foot", Z),)),
    Factor("pelvis_width", 0.20, ((SIZES, "pelvis", LONG),)),
    Factor("pelvis_depth", 0.20, ((SIZES, "pelvis", SHORT),)),
    Factor("waist_width", 0.20, ((SIZES, "chest", LONG), (TIPS, "pelvis", 0))),
    Factor("waist_depth", 0.20, ((SIZES, "chest", SHORT), (TIPS, "pelvis", 1))),
    Factor("chest_width", 0.15, ((TIPS, "chest", 0),)),
    Factor("chest_depth", 0.20, ((TIPS, "chest", 1),)),
    Factor("neck_width", 0.30, ((SIZES, "neck_column", LONG),)),
    Factor("neck_depth", 0.30, ((SIZES, "neck_column", SHORT),)),
    _girth("throat", 0.20, (TIPS, "neck_column")),
    Factor("head_width", 0.15, ((SIZES, "head", LONG), (TIPS, "head", 0))),
    Factor("head_depth", 0.15, ((SIZES, "head", SHORT), (TIPS, "head", 1))),
    _girth("deltoid", 0.20, (SIZES, "upper_arm")),
    _girth("elbow", 0.20, (TIPS, "upper_arm"), (SIZES, "lower_arm")),
    _girth("hand", 0.30, (TIPS, "lower_arm")),
    _girth("groin", 0.20, (SIZES, "upper_leg")),
    _girth("knee", 0.20, (TIPS, "upper_leg"), (SIZES, "lower_leg")),
    _girth("ankle", 0.20, (TIPS, "lower_leg")),
    _girth("heel", 0.20, (SIZES, "foot")),
    _girth("toes", 0.20, (TIPS, "foot")),
)  # fmt: skip
# The paper's ten parts are cylinders: a radius is the same at both ends, and the torso is one of them.  [Hybrid II]
# Their lengths follow stature: a shorter cylinder fits a tapered limb better, so a fit would shorten arms by a third.
CYLINDERS: Mapping[str, tuple[tuple[int, str, int], ...]] = {
    "pelvis_width": ((SIZES, "torso", LONG), (TIPS, "torso", 0)),
    "pelvis_depth": ((SIZES, "torso", SHORT), (TIPS, "torso", 1)),
    "deltoid": _radii((SIZES, "upper_arm"), (TIPS, "upper_arm")),
    "hand": _radii((SIZES, "lower_arm"), (TIPS, "lower_arm")),
    "groin": _radii((SIZES, "upper_leg"), (TIPS, "upper_leg")),
    "ankle": _radii((SIZES, "lower_leg"), (TIPS, "lower_leg")),
}
SHARED = ("head_width", "head_depth")  # as of tapered parts
COUNT = 1 + len(FACTORS)  # stature first
SIZE_NAMES = (STATURE.name, *(factor.name for factor in FACTORS))
SPREADS: Floats = np.array([STATURE.spread, *(factor.spread for factor in FACTORS)])


def scaled(anatomy: Anatomy, body: Bdp, logs: Floats) -> Bdp:
    """Body with stature and FACTORS multiplied by exp(logs), (COUNT,)."""
    arrays = [array * float(np.exp(logs[0])) for array in _arrays(body)]
    for number, array, row, column in entries_of(anatomy):
        arrays[array][row, column] *= np.exp(logs[number])
    return replace(body, sizes=arrays[SIZES], tips=arrays[TIPS], bases=arrays[BASES], offsets=arrays[OFFSETS])


def _entries(anatomy: Anatomy, factor: Factor) -> tuple[tuple[int, str, int], ...]:
    """Entries that a factor multiplies in an anatomy; empty where the anatomy lacks that size."""
    if anatomy is not TEN_PARTS or factor.name in SHARED:
        return factor.entries
    return CYLINDERS.get(factor.name, ())


@lru_cache
def entries_of(anatomy: Anatomy) -> Ints:
    """(n, 4) entries that the factors multiply: factor (from 1), array, row of part or joint, column."""
    rows: dict[bool, dict[str, list[int]]] = {False: {}, True: {}}
    for k, joint in enumerate(anatomy.joints):
        rows[False].setdefault(without_side(joint.part), []).append(k)
        rows[True].setdefault(without_side(joint.name), []).append(k)
    found = [
        (number, array, row, column)
        for number, factor in enumerate(FACTORS, 1)
        for array, name, column in _entries(anatomy, factor)
        for row in rows[array == OFFSETS].get(name, [])
    ]
    return np.array(found, dtype=np.int64).reshape(-1, 4)


def values_of(anatomy: Anatomy, body: Bdp) -> Floats:
    """(n,) values of `entries_of` in a body, metres."""
    arrays = _arrays(body)
    return np.array([arrays[array][row, column] for _, array, row, column in entries_of(anatomy)])


def _arrays(body: Bdp) -> tuple[Floats, Floats, Floats, Floats]:
    return body.sizes, body.far_radii, body.starts, body.offsets
