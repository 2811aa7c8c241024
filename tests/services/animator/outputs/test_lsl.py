"""LSL output, received by LSL's own inlet on this machine."""

from collections.abc import Iterator
from types import ModuleType
from unittest.mock import Mock

import numpy as np
import pytest

from tests.support.virtual_actors import BODIES, centres_of, posed, stretched
from zenocap.common.rig.animator import LslTable
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.animator.outputs import lsl
from zenocap.services.animator.outputs.lsl import LslOutput
from zenocap.services.animator.outputs.output import OutputError

TABLE = LslTable(stream="zenocap-test")


@pytest.fixture(scope="module")
def pylsl() -> ModuleType:
    return pytest.importorskip("pylsl", reason="pylsl is not installed: the extra lsl")


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(stretched("ten-parts").captured_ns)


@pytest.fixture
def output(pylsl: ModuleType, clock: ManualClock) -> Iterator[LslOutput]:
    one = LslOutput(TABLE, "studio", clock)
    yield one
    one.close()


def inlet(pylsl: ModuleType, output: LslOutput):
    """A connected receiver; the outlet exists from the first pose on."""
    output.send(stretched("ten-parts"), None)
    (found,) = pylsl.resolve_byprop("name", "zenocap-test", timeout=60)
    receiver = pylsl.StreamInlet(found)
    receiver.open_stream(timeout=60)
    assert output.outlet.wait_for_consumers(60)
    return receiver


def test_joint_centres_arrive_as_named_channels(pylsl: ModuleType, output: LslOutput) -> None:
    receiver = inlet(pylsl, output)
    info = receiver.info(timeout=60)
    assert (info.type(), info.channel_count(), info.nominal_srate()) == ("MoCap", 45, 0.0)
    labels, units = [], set()
    channel = info.desc().child("channels").child("channel")
    while not channel.empty():
        labels.append(channel.child_value("label"))
        units.add(channel.child_value("unit"))
        channel = channel.next_sibling("channel")
    assert labels[:4] == ["Hip_X", "Hip_Y", "Hip_Z", "RHip_X"]
    assert len(set(labels)) == 45
    assert units == {"meters"}

    actor = posed("ten-parts", np.full(25, 0.6), np.array([0.2, 1.0, -0.4]))
    output.send(actor, None)
    sample, _ = receiver.pull_sample(timeout=60)
    found = dict(zip(labels, sample, strict=True))
    for joint, place in centres_of(actor).items():
        np.testing.assert_allclose([found[f"{joint}_{axis}"] for axis in "XYZ"], place, atol=1e-6)
    assert output.counts() == {"sent": 2}


def test_samples_have_their_capture_time_and_those_of_a_replay_the_present_time(
    pylsl: ModuleType, output: LslOutput, clock: ManualClock
) -> None:
    receiver = inlet(pylsl, output)
    ages = []
    for age_ns in (0, 250_000_000, 86_400_000_000_000):
        clock.set(stretched("ten-parts").captured_ns + age_ns)
        before = pylsl.local_clock()
        output.send(stretched("ten-parts"), None)
        _, stamp = receiver.pull_sample(timeout=60)
        ages.append(before - stamp)
    np.testing.assert_allclose(ages, [0, 0.25, 0], atol=0.1)


def test_samples_of_a_lost_person_are_nan(pylsl: ModuleType, output: LslOutput) -> None:
    receiver = inlet(pylsl, output)
    output.send(stretched("ten-parts", lost=("person",)), None)
    sample, _ = receiver.pull_sample(timeout=60)
    assert np.isnan(sample).all()


def test_both_anatomies_have_the_same_channels() -> None:
    names = [[marker.name for marker in anatomy.markers] for anatomy, _ in BODIES.values()]
    assert names[0] == names[1]


def test_a_missing_pylsl_is_one_line_with_the_remedy(monkeypatch: pytest.MonkeyPatch, clock: ManualClock) -> None:
    monkeypatch.setattr(lsl, "import_module", Mock(side_effect=ModuleNotFoundError("No module named 'pylsl'")))
    with pytest.raises(OutputError, match=r"^animator\.lsl: needs pylsl: .+ -m pip install 'zenocap\[lsl\]' \(No module"):
        LslOutput(TABLE, "studio", clock)
