"""Body measures of people, drawn from two surveys that the tracker's constants do not come from.

Adults: ANSUR II, 1986 women and 4082 men (Gordon et al. 2014).  The logarithms of the measures are drawn from a normal
distribution with the survey's means and covariance, the deviations enlarged, because soldiers are selected by their size.
Children: an adult's measures, each times the ratio of its means at the child's age and at 18 in Snyder et al. (1977).
"""

import json
from dataclasses import dataclass
from functools import cache

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.data import PEOPLE

# Measures as ANSUR II names them, and whose growth each follows in Snyder et al.; None: a constant share of stature.
_GROWTH: dict[str, str | None] = {
    "stature": "stature",
    "acromialheight": "suprasternale height",
    "trochanterionheight": "trochanteric height",
    "lateralfemoralepicondyleheight": "tibiale height",
    "lateralmalleolusheight": None,
    "acromionradialelength": "shoulder-elbow length",
    "radialestylionlength": "elbow-hand length",
    "handlength": "hand length",
    "footlength": "foot length",
    "biacromialbreadth": "biacromial breadth",
    "bicristalbreadth": "hip breadth",
    "hipbreadth": "hip breadth",
    "chestbreadth": "chest breadth",
    "chestdepth": "chest circumference",
    "waistbreadth": "waist circumference",
    "waistdepth": "waist circumference",
    "buttockdepth": "hip circumference",
    "headbreadth": "head breadth",
    "headlength": "head length",
    "thighcircumference": "upper thigh circumference",
    "lowerthighcircumference": "upper thigh circumference",
    "calfcircumference": "calf circumference",
    "anklecircumference": "calf circumference",
    "bicepscircumferenceflexed": "calf circumference",
    "forearmcircumferenceflexed": "calf circumference",
    "wristcircumference": "calf circumference",
    "neckcircumference": "neck circumference",
}
MEASURES = tuple(_GROWTH)

SPREAD = 1.3  # on the deviations of ANSUR II; chosen by hand
MOST_SIGMAS = 2.5  # of a deviation along each principal axis; chosen by hand
CHILDREN = 0.2  # share of the people
CHILD_AGES = (6.0, 16.0)  # years


@dataclass(frozen=True)
class Build:
    """Measures of one person in metres, by their names in ANSUR II.  age: years, None for an adult."""

    woman: bool
    age: float | None
    measures: dict[str, float]


def draw_build(rng: np.random.Generator) -> Build:
    """Draw a woman or man with equal probability, among them CHILDREN boys and girls."""
    woman = bool(rng.uniform() < 0.5)
    age = float(rng.uniform(*CHILD_AGES)) if rng.uniform() < CHILDREN else None
    mean, axes = _adults("women" if woman else "men")
    logarithms = mean + axes @ (SPREAD * np.clip(rng.normal(size=len(mean)), -MOST_SIGMAS, MOST_SIGMAS))
    if age is not None:
        logarithms += _growth(age)
    return Build(woman, age, dict(zip(MEASURES, np.exp(logarithms).tolist(), strict=True)))


@cache
def _adults(sex: str) -> tuple[Floats, Floats]:
    """Means (m,) of the logarithms of the measures, and (m, m) principal axes scaled by their standard deviations."""
    content = json.loads((PEOPLE / "adults.json").read_text(encoding="utf-8"))
    rows = content[sex]["covariance"]
    covariance = np.zeros((len(rows), len(rows)))
    for k, row in enumerate(rows):
        covariance[k, : k + 1] = covariance[: k + 1, k] = row
    variances, axes = np.linalg.eigh(covariance)
    return np.array(content[sex]["mean"]), axes * np.sqrt(np.maximum(variances, 0.0))


def _growth(age: float) -> Floats:
    """(m,) logarithms of the measures at this age minus those at the end of growth."""
    content = json.loads((PEOPLE / "children.json").read_text(encoding="utf-8"))
    ages = content["ages"]

    def ratio(name: str | None) -> float:
        values = content[name or "stature"]
        if name == "elbow-hand length":  # with the hand; the forearm is what remains
            values = np.array(values) - content["hand length"]
        return float(np.log(np.interp(age, ages, values) / values[-1]))

    return np.array([ratio(name) for name in _GROWTH.values()])
