"""Smoothing of pose messages: only poses are changed, and only while the person is tracked."""

import msgspec
import numpy as np
import pytest

from tests.common.formats.test_smoothing import gentle
from tests.common.formats.test_take_poses import START_NS, baps_of, messages_of_track
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.live_smoothing import LiveSmoothing, live_smoothing


def smoothing() -> LiveSmoothing:
    return live_smoothing("one-euro")


def accelerations(messages: list[m.Message], exact: PoseTrack) -> float:
    poses = [one for one in messages if isinstance(one, m.UniversalBap)]
    values = np.array([[one.angles[name] for name in TEN_PARTS.angles] for one in poses])
    return float(np.std(np.diff(values - exact.angles, 2, axis=0)))


def test_poses_are_smoothed_and_everything_else_is_the_same_object() -> None:
    track, filter = gentle(90), smoothing()
    raw = messages_of_track(track)
    found = [filter.message(one) for one in raw]
    assert [one is other for one, other in zip(raw[:3], found[:3], strict=True)] == [True, True, False]
    exact = gentle(90, noise=0.0)
    assert accelerations(found, exact) < 0.6 * accelerations(raw, exact)
    for one, other in zip(raw, found, strict=True):
        assert (other.frame, other.captured_ns) == (one.frame, one.captured_ns)
        codec.encode(other)


def test_equal_messages_give_equal_bytes() -> None:
    raw = messages_of_track(gentle(40))
    runs = [[codec.encode(filter.message(one)) for one in raw] for filter in (smoothing(), smoothing())]
    assert runs[0] == runs[1]


def test_a_lost_person_passes_and_restarts_the_filter() -> None:
    filter, track = smoothing(), gentle(40)
    raw = messages_of_track(track)
    gone = msgspec.structs.replace(baps_of(gentle(1))[0], lost=["person"], captured_ns=START_NS)
    for one in raw[:20]:
        filter.message(one)
    assert filter.message(gone) is gone
    first = filter.message(raw[20])
    assert first.position == raw[20].position
    assert filter.message(raw[21]) != raw[21]


def test_poses_before_a_body_and_of_another_anatomy_pass() -> None:
    filter, raw = smoothing(), messages_of_track(gentle(5))
    assert all(filter.message(one) is one for one in raw[2:])
    filter.message(raw[1])
    odd = baps_of(gentle(1))[0]
    odd.angles["third_arm.x"] = 0.0
    assert filter.message(odd) is odd


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("butterworth",), "smooth = 'butterworth': allowed: 'off', 'one-euro'"),
        (("off", 1.0), "smooth_hz = 1.0: allowed: only with smooth = 'one-euro'"),
        (("one-euro", float("nan")), "smooth_hz = nan: allowed: 0.1 to 30"),
        (("one-euro", 1.0, 1e9), "smooth_beta = 1000000000.0: allowed: 0 to 100"),
    ],
)
def test_errors_name_key_value_and_what_is_allowed(arguments: tuple[str, float], error: str) -> None:
    with pytest.raises(UserError) as raised:
        live_smoothing(*arguments)
    assert str(raised.value) == error
