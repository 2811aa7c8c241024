"""Groups of the ablation: they divide all values, and each has those that its columns of rows change."""

import numpy as np
import pytest

from benchmarks.recognition.ablation import EVERY, Material, by_channel, by_statistic, trials, variants
from zenocap.common.arrays import Ints
from zenocap.services.recognizer.motion_rows import ANGLES, HEADING, HEIGHT, POINTS, TRUNK_UP, WAY, WIDTH
from zenocap.services.recognizer.segment_description import VALUES, describe

RATE = 15.0


@pytest.mark.parametrize("groups", [by_channel(), by_statistic()])
def test_groups_divide_the_values(groups: dict[str, Ints]) -> None:
    np.testing.assert_array_equal(np.sort(np.concatenate(list(groups.values()))), np.arange(VALUES))


@pytest.mark.parametrize(
    ("columns", "names"),
    [
        (ANGLES, {"angles"}),
        (POINTS, {"joint positions", "speeds of the joints"}),
        (TRUNK_UP, {"lean of the trunk"}),
        (slice(HEIGHT, HEIGHT + 1), {"height of the hips"}),
        (WAY, {"velocity of the hips"}),
        (HEADING, {"turn", "velocity of the hips"}),
    ],
)
def test_a_group_has_the_values_that_its_columns_change(columns: slice, names: set[str]) -> None:
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(40, WIDTH))
    changed = rows.copy()
    changed[:, columns] = rng.normal(size=changed[:, columns].shape)
    different = set(np.flatnonzero(describe(rows, RATE) != describe(changed, RATE)).tolist())
    by_name = {name: set(indices.tolist()) for name, indices in by_channel().items()}
    assert {name for name, indices in by_name.items() if indices & different} == names


def test_the_duration_is_a_group_of_its_own() -> None:
    rows = np.zeros((40, WIDTH))
    rows[:, HEADING] = (0.0, 1.0)
    (index,) = by_channel()["duration"].tolist()
    np.testing.assert_array_equal(np.flatnonzero(describe(rows, RATE) != describe(rows[:20], RATE)), [index])


def test_each_variant_leaves_out_a_group_or_has_it_alone() -> None:
    found = variants()
    assert len(found[EVERY]) == VALUES
    for name in (*by_channel(), *by_statistic()):
        without, alone = found[f"without {name}"], found[f"only {name}"]
        np.testing.assert_array_equal(np.sort(np.concatenate([without, alone])), np.arange(VALUES))


@pytest.mark.nightly
def test_postures_that_differ_in_one_group_need_it() -> None:
    rng = np.random.default_rng(4)
    turn = by_channel()["turn"]
    labels = np.repeat([0, 1], 20)
    values = rng.normal(size=(40, 5, VALUES))
    values[:, :, turn] += 8.0 * labels[:, None, None]
    material = Material(values, labels, 2, tuple((k, k + 20) for k in range(0, 20, 5)))
    margins = {name: list(trials(material, variants()[name], 0)) for name in ("only turn", "without turn")}
    assert len(margins["only turn"]) == 8
    assert np.mean(margins["only turn"]) > 0.9
    assert abs(np.mean(margins["without turn"])) < 0.4
