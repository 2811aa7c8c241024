"""Ablation of the adaptive background: a part that is off changes its own results only."""

import pytest

from benchmarks.rooms import ablation


@pytest.mark.parametrize("part", ablation.PARTS)
def test_a_part_is_off_within_the_context_only(part: str) -> None:
    module, name, other = ablation.PARTS[part]
    before = getattr(module, name)
    with ablation.without(part):
        assert getattr(module, name) is other
    assert getattr(module, name) is before


@pytest.mark.nightly
def test_without_a_new_mean_a_lamp_that_is_switched_off_costs_overlap() -> None:
    both, none = ablation.overlaps((3, "lamp switched off"), (96, 72), (ablation.ALL, "relight"))
    assert both > none + 0.05


@pytest.mark.nightly
def test_without_the_gain_a_fading_light_costs_overlap() -> None:
    both, none = ablation.overlaps((3, "light fades by 40 %"), (96, 72), (ablation.ALL, "gain"))
    assert both > none + 0.02


def test_the_table_has_the_mean_change_and_the_farthest_seed() -> None:
    found = {(0, "a"): [0.9, 0.8, 0.9], (1, "a"): [0.7, 0.65, 0.7]}
    assert ablation.rows(["a"], [0, 1], found) == [["a", "0.800", "-0.075 (-0.100)", "0"]]
