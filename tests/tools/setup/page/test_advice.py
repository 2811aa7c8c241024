"""Rows of the page: good measures have no advice, each bad one has its own."""

from dataclasses import replace

import pytest

from zenocap.common.vision.image_measures import Exposure, Light
from zenocap.services.viewer.parameters import HIGH_DRIFT, HIGH_FLICKER
from zenocap.tools.setup.page.advice import Measures, rows

GOOD = Measures(29.9, 30.0, 0.001, 1.0, 0.9, Exposure(120.0, 0.01, 0.02), 2.0, Light(0.01, 0.002))


def test_good_measures_have_no_advice():
    found = rows(GOOD)
    assert [one.verdict for one in found] == ["good"] * 7
    assert not any(one.advice for one in found)
    assert found[2].share == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("changed", "key", "word"),
    [
        ({"rate": 15.0}, "rate", "add light"),
        ({"jitter_s": 0.012}, "jitter", "USB port"),
        ({"focus": 0.3}, "focus", "turn the focus"),
        ({"exposure": Exposure(120.0, 0.2, 0.0)}, "exposure", "saturated"),
        ({"exposure": Exposure(20.0, 0.0, 0.5)}, "exposure", "Too dark"),
        ({"exposure": Exposure(230.0, 0.0, 0.0)}, "exposure", "Too bright"),
        ({"exposure": Exposure(80.0, 0.0, 0.5)}, "exposure", "black"),
        ({"noise": 9.0}, "noise", "lower the gain"),
        ({"light": Light(-0.2, 0.0)}, "drift", "fix exposure"),
        ({"light": Light(0.0, 0.05)}, "flicker", "1/100 s"),
    ],
)
def test_a_bad_measure_has_its_advice(changed, key, word):
    bad = [one for one in rows(replace(GOOD, **changed)) if one.verdict == "bad"]
    assert [one.key for one in bad] == [key]
    assert word in bad[0].advice


def test_the_limits_of_the_light_are_those_of_a_running_viewer():
    for share, verdict in ((0.9, "good"), (1.1, "bad")):
        light = Light(-share * HIGH_DRIFT / 100.0, share * HIGH_FLICKER / 100.0)
        assert [one.verdict for one in rows(replace(GOOD, light=light))[-2:]] == [verdict] * 2


def test_what_is_unknown_waits():
    unknown = Measures(None, 30.0, None, 0.0)
    assert {one.verdict for one in rows(unknown)} == {"wait"}
    assert next(one for one in rows(replace(GOOD, noise=float("nan"))) if one.key == "noise").verdict == "wait"
