"""Hypotheses on the rig: which of several that hold is stated."""

from collections.abc import Mapping

import numpy as np
import pytest

from zenocap.tools.judge.rig_faults import Hypothesis, SeenRig


@pytest.mark.parametrize(
    ("shares", "stated"),
    [
        ({"one": 1.0, "two": 0.7}, "one"),
        ({"one": 0.9, "two": 1.0}, "two; or one"),
        ({"one": 1.0, "two": 0.95, "three": 0.9}, None),
        ({"one": 0.8}, None),
    ],
)
def test_two_orders_that_hold_about_as_often_are_both_stated(
    monkeypatch: pytest.MonkeyPatch, shares: Mapping[str, float], stated: str | None
) -> None:
    monkeypatch.setattr(SeenRig, "held", lambda _, one: np.array([shares[one.text]]))
    found = SeenRig({}, []).likeliest(Hypothesis("swapped", (text,), text, {}) for text in shares)
    assert (found and found.text) == stated
    assert found is None or set(found.viewers) == set(stated.split("; or ") if stated else ())
