"""Drawn body measures against the tables of the surveys they come from."""

import json

import numpy as np
import pytest

from zenocap.data import PEOPLE
from zenocap.simulation.body.anthropometry import CHILD_AGES, CHILDREN, MEASURES, SPREAD, Build, draw_build

# Means and standard deviations in mm, computed directly from the individual data of ANSUR II.
WOMEN = {"stature": (1628.5, 64.2), "trochanterionheight": (845.4, 44.7), "biacromialbreadth": (365.3, 18.3)}
MEN = {"stature": (1756.2, 68.5), "acromialheight": (1440.7, 63.3), "waistbreadth": (326.4, 34.7)}


@pytest.fixture(scope="module")
def builds() -> list[Build]:
    return [draw_build(np.random.default_rng(seed)) for seed in range(4000)]


@pytest.mark.slow
@pytest.mark.parametrize(("woman", "expected"), [(True, WOMEN), (False, MEN)], ids=["women", "men"])
def test_adults_have_the_means_and_the_enlarged_spread_of_the_survey(
    builds: list[Build], woman: bool, expected: dict[str, tuple[float, float]]
) -> None:
    for name, (mean, deviation) in expected.items():
        values = 1000 * np.array([b.measures[name] for b in builds if b.woman == woman and b.age is None])
        assert np.mean(values) == pytest.approx(mean, rel=0.01), name
        assert np.std(values) == pytest.approx(SPREAD * deviation, rel=0.08), name  # clipping takes some off


def test_measures_of_one_person_are_correlated(builds: list[Build]) -> None:
    values = np.array([[b.measures[n] for n in ("stature", "trochanterionheight")] for b in builds if b.age is None])
    assert np.corrcoef(values.T)[0, 1] > 0.85


def test_children_have_the_proportions_of_their_age(builds: list[Build]) -> None:
    children = [b for b in builds if b.age is not None]
    assert len(children) / len(builds) == pytest.approx(CHILDREN, abs=0.03)
    assert {CHILD_AGES[0] <= b.age <= CHILD_AGES[1] for b in children if b.age is not None} == {True}
    young = [b.measures for b in children if b.age is not None and b.age < 8]
    adult = [b.measures for b in builds if b.age is None]

    def share(people: list[dict[str, float]], name: str) -> float:
        return float(np.mean([m[name] / m["stature"] for m in people]))

    # Snyder et al. 1977: hips at 0.491 to 0.501 of stature, at 18 0.507; heads 0.121 to 0.112 broad, at 18 0.089.
    assert share(young, "trochanterionheight") == pytest.approx(share(adult, "trochanterionheight") * 0.978, rel=0.01)
    assert share(young, "headbreadth") == pytest.approx(share(adult, "headbreadth") * 1.31, rel=0.03)
    assert 0.9 < min(m["stature"] for m in young) < max(m["stature"] for m in young) < 1.5


def test_the_table_has_the_measures_in_order() -> None:
    content = json.loads((PEOPLE / "adults.json").read_text(encoding="utf-8"))
    assert tuple(content["measures"]) == MEASURES
    assert (content["women"]["count"], content["men"]["count"]) == (1986, 4082)
