"""Latency spans of frame sets from messages: parts, clocks, missing messages, every N-th."""

import pytest
from msgspec import structs

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope, RoundTrip
from zenocap.common.observe.spans import SpanReader
from zenocap.common.topics import topic_of

S = 1_000_000_000
START_NS = 1_700_000_000 * S
MS = 1_000_000


def at(message: m.Message, received_ns: int) -> Envelope:
    return Envelope("key", topic_of(type(message)), message, received_ns)


def silhouette(viewer: str, captured_ns: int, received_ns: int) -> Envelope:
    return at(built(m.Silhouette, captured_ns=captured_ns, viewer=viewer), received_ns)


def pose(captured_ns: int, received_ns: int) -> Envelope:
    return at(built(m.TrackerPose, captured_ns=captured_ns), received_ns)


def with_clock(reader: SpanReader, offset_ns: int = 0) -> SpanReader:
    """This machine's clock is ahead of the integrator's."""
    for k in range(8):
        sent = START_NS - S + k * 10 * MS + offset_ns
        reader.receive(RoundTrip(sent, sent - offset_ns + MS, sent + 2 * MS))
    return reader


def test_the_spans_have_silhouettes_and_the_tracker():
    reader = with_clock(SpanReader("rig", 1))
    reader.receive(silhouette("1", START_NS, START_NS + 8 * MS))
    reader.receive(silhouette("2", START_NS + 3 * MS, START_NS + 12 * MS))
    spans = reader.receive(pose(START_NS, START_NS + 25 * MS))
    assert spans is not None
    assert [part.service for part in spans.parts] == ["viewer 1", "viewer 2", "tracker"]
    times = [(ns - START_NS) / MS for part in spans.parts for ns in (part.begin_ns, part.end_ns)]
    assert times == pytest.approx([0, 8, 3, 12, 12, 25], abs=0.6)
    assert (spans.whole.begin_ns, spans.whole.end_ns) == (spans.parts[0].begin_ns, spans.parts[2].end_ns)
    assert spans.whole.attributes["zenocap.views"] == 2
    assert spans.whole.attributes["zenocap.lost"] is False


def test_a_wrong_clock_of_this_machine_is_corrected():
    ahead_ns = 5 * S
    reader = with_clock(SpanReader("rig", 1), ahead_ns)
    reader.receive(silhouette("1", START_NS, START_NS + 8 * MS + ahead_ns))
    spans = reader.receive(pose(START_NS, START_NS + 20 * MS + ahead_ns))
    assert spans is not None
    assert spans.whole.end_ns - spans.whole.begin_ns == pytest.approx(20 * MS, abs=MS)


def test_messages_of_other_frame_sets_are_not_in_the_spans():
    reader = with_clock(SpanReader("rig", 1))
    for k in range(10):
        reader.receive(silhouette("1", START_NS + k * 100 * MS, START_NS + k * 100 * MS + 8 * MS))
    reader.receive(silhouette("2", START_NS - 300 * MS, START_NS - 290 * MS))
    spans = reader.receive(pose(START_NS + 500 * MS, START_NS + 525 * MS))
    assert spans is not None
    assert [part.service for part in spans.parts] == ["viewer 1", "tracker"]
    assert spans.parts[0].begin_ns == pytest.approx(START_NS + 500 * MS, abs=MS)


def test_one_of_n_is_traced():
    reader = with_clock(SpanReader("rig", 3))
    found = []
    for k in range(9):
        reader.receive(silhouette("1", START_NS + k * 33 * MS, START_NS + k * 33 * MS + 5 * MS))
        found.append(reader.receive(pose(START_NS + k * 33 * MS, START_NS + k * 33 * MS + 20 * MS)) is not None)
    assert found == [True, False, False] * 3


def test_a_pose_of_both_passes_has_no_spans_of_its_own():
    reader = with_clock(SpanReader("rig", 1))
    reader.receive(silhouette("1", START_NS, START_NS + 8 * MS))
    message = m.BothWaysPose(**structs.asdict(pose(START_NS, 0).message), backward={})
    assert reader.receive(at(message, START_NS + 25 * MS)) is None


@pytest.mark.parametrize("late_ns", [61 * S, -61 * S])
def test_a_replayed_pose_has_no_spans(late_ns):
    reader = with_clock(SpanReader("rig", 1))
    reader.receive(silhouette("1", START_NS, START_NS + late_ns))
    assert reader.receive(pose(START_NS, START_NS + late_ns)) is None


def test_without_a_clock_or_silhouettes_there_are_no_spans():
    unknown = SpanReader("rig", 1)
    unknown.receive(silhouette("1", START_NS, START_NS + MS))
    for reader in (unknown, with_clock(SpanReader("rig", 1))):
        assert reader.receive(pose(START_NS, START_NS + 2 * MS)) is None


def test_names_from_the_network_are_kept_up_to_a_limit():
    reader = with_clock(SpanReader("rig", 1))
    for k in range(2000):
        reader.receive(silhouette(f"v{k}", START_NS, START_NS + MS))
    spans = reader.receive(pose(START_NS, START_NS + 2 * MS))
    assert spans is not None
    assert len(spans.parts) <= 3 * 64 + 1
