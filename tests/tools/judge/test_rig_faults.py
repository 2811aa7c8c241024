"""Hypotheses on the rig: which of several that hold is stated."""

from collections.abc import Mapping

import numpy as np
import pytest

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.arrays import Bools
from zenocap.tools.judge import rig_faults
from zenocap.tools.judge.evidence import evidence_of
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


@pytest.mark.parametrize(("since", "timed"), [(3, False), (6, True), (12, True), (18, True), (21, None), (0, None)])
def test_a_camera_moved_within_a_take_is_found_from_a_quarter_to_three(
    monkeypatch: pytest.MonkeyPatch, since: int, timed: bool | None
) -> None:
    """Of 24 seconds: from then on the views agree only without it.  0: nobody is seen."""

    def held(rig: SeenRig, one: Hypothesis) -> Bools:
        agree = one.kind in ("", "one-view")
        return np.array([agree and (k < since * 10**9 or "cam02" not in one.films) for k, _ in rig.sets], dtype=np.bool_)

    monkeypatch.setattr(SeenRig, "held", held)
    monkeypatch.setattr(rig_faults, "frame_sets", lambda *_: [(k * 10**9, {}) for k in range(24 if since else 0)])
    found = rig_faults.rig_fault(evidence_of(built(m.CameraInfo, viewer=f"cam0{k}") for k in range(4)))
    when = f" from about {since} s on, not before" if timed else ", which agree"
    begin = None if timed is None else f"camera cam02 contradicts the others{when}"
    assert (found and found.text.partition(":")[0]) == begin
