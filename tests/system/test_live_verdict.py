"""Verdict of `zenocap info` on takes of live rigs."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.support.processes import completed
from tests.support.session_rigs import TRACKED
from zenocap.tools.judge.parameters import UNUSABLE_EXPECTED_M, UNUSABLE_LOST

pytestmark = pytest.mark.nightly
LEAST_S = TRACKED / 15.0  # of the take, with the person tracked


def info(take: Path, *arguments: str) -> str:
    done = completed(["info", take, *arguments], take.parent)
    assert done.returncode == 0, done.stderr
    return done.stdout


def check(take: Path, evidence: str, rests_on: str) -> None:
    """The verdict is computed from poses and silhouettes, and covers the time in which the person was tracked.

    Which rating it is depends on the processors that other tests leave; one that is not good has its reasons.
    """
    found = json.loads(info(take, "--json"))
    verdict = found["verdict"]
    assert not found["verdict_stored"]
    assert verdict["evidence"] == evidence
    assert (verdict["rating"] == "good") == (not verdict["reasons"]), verdict
    lost = np.mean([one["lost"] for one in verdict["stretches"]])
    unusable = verdict["error"] > UNUSABLE_EXPECTED_M or lost > UNUSABLE_LOST
    assert (verdict["rating"] == "unusable") == unusable, verdict
    spans_s = [(one["end_ns"] - one["start_ns"]) / 1e9 for one in verdict["stretches"]]
    assert sum(spans_s) > LEAST_S / 2
    text = info(take)
    assert f"verdict: {verdict['rating']}: expected error of the joints" in text
    assert re.search(rf"rests on +{rests_on}; computed now", text), text


def test_info_computes_the_verdict_of_a_take_of_the_live_tracker(ring_take: Path) -> None:
    check(ring_take, "one-pass", "poses of one pass, silhouettes")


def test_info_computes_the_verdict_of_a_take_of_live_two_view(two_view_take: Path) -> None:
    check(two_view_take, "two-view", "poses of two-view, silhouettes")
