"""Ways of instants from messages: parts, clocks, missing messages, every N-th."""

import pytest
from msgspec import structs

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope, RoundTrip
from zenocap.common.topics import topic_of
from zenocap.tools.traces.instants import Instants

S = 1_000_000_000
START_NS = 1_700_000_000 * S
MS = 1_000_000


def heard(message: m.Message, received_ns: int) -> Envelope:
    return Envelope("key", topic_of(type(message)), message, received_ns)


def silhouette(viewer: str, captured_ns: int, received_ns: int) -> Envelope:
    message = m.Silhouette(frame=1, captured_ns=captured_ns, viewer=viewer, size=(8, 8), region=(0, 0, 0, 0), data=b"")
    return heard(message, received_ns)


def pose(captured_ns: int, received_ns: int, lost: bool = False) -> Envelope:
    message = m.TrackerPose(
        frame=7, captured_ns=captured_ns, position=(0.0, 0.0, 0.0), angles={}, position_spread=(0.0, 0.0, 0.0),
        spread={}, likelihood=0.0, effective=40.0, lost=lost, views=["1"],
    )  # fmt: skip
    return heard(message, received_ns)


def with_clock(instants: Instants, offset_ns: int = 0) -> Instants:
    """This machine's clock is ahead of the integrator's."""
    for k in range(8):
        sent = START_NS - S + k * 10 * MS + offset_ns
        instants.receive(RoundTrip(sent, sent - offset_ns + MS, sent + 2 * MS))
    return instants


def test_the_way_has_silhouettes_and_the_tracker():
    instants = with_clock(Instants("rig", 1))
    instants.receive(silhouette("1", START_NS, START_NS + 8 * MS))
    instants.receive(silhouette("2", START_NS + 3 * MS, START_NS + 12 * MS))
    way = instants.receive(pose(START_NS, START_NS + 25 * MS))
    assert way is not None
    assert [part.service for part in way.parts] == ["viewer 1", "viewer 2", "tracker"]
    times = [(ns - START_NS) / MS for part in way.parts for ns in (part.begin_ns, part.end_ns)]
    assert times == pytest.approx([0, 8, 3, 12, 12, 25], abs=0.6)
    assert (way.whole.begin_ns, way.whole.end_ns) == (way.parts[0].begin_ns, way.parts[2].end_ns)
    assert way.whole.attributes["zenocap.views"] == 2
    assert way.whole.attributes["zenocap.lost"] is False


def test_a_wrong_clock_of_this_machine_is_corrected():
    ahead_ns = 5 * S
    instants = with_clock(Instants("rig", 1), ahead_ns)
    instants.receive(silhouette("1", START_NS, START_NS + 8 * MS + ahead_ns))
    way = instants.receive(pose(START_NS, START_NS + 20 * MS + ahead_ns))
    assert way is not None
    assert way.whole.end_ns - way.whole.begin_ns == pytest.approx(20 * MS, abs=MS)


def test_messages_of_other_instants_are_not_in_the_way():
    instants = with_clock(Instants("rig", 1))
    for k in range(10):
        instants.receive(silhouette("1", START_NS + k * 100 * MS, START_NS + k * 100 * MS + 8 * MS))
    instants.receive(silhouette("2", START_NS - 300 * MS, START_NS - 290 * MS))
    way = instants.receive(pose(START_NS + 500 * MS, START_NS + 525 * MS))
    assert way is not None
    assert [part.service for part in way.parts] == ["viewer 1", "tracker"]
    assert way.parts[0].begin_ns == pytest.approx(START_NS + 500 * MS, abs=MS)


def test_one_of_n_is_traced():
    instants = with_clock(Instants("rig", 3))
    found = []
    for k in range(9):
        instants.receive(silhouette("1", START_NS + k * 33 * MS, START_NS + k * 33 * MS + 5 * MS))
        found.append(instants.receive(pose(START_NS + k * 33 * MS, START_NS + k * 33 * MS + 20 * MS)) is not None)
    assert found == [True, False, False] * 3


def test_a_pose_of_both_passes_has_no_way_of_its_own():
    instants = with_clock(Instants("rig", 1))
    instants.receive(silhouette("1", START_NS, START_NS + 8 * MS))
    message = m.BothWaysPose(**structs.asdict(pose(START_NS, 0).message), backward={})
    assert instants.receive(heard(message, START_NS + 25 * MS)) is None


@pytest.mark.parametrize("late_ns", [61 * S, -61 * S])
def test_a_replayed_pose_has_no_way(late_ns):
    instants = with_clock(Instants("rig", 1))
    instants.receive(silhouette("1", START_NS, START_NS + late_ns))
    assert instants.receive(pose(START_NS, START_NS + late_ns)) is None


def test_without_a_clock_or_silhouettes_there_is_no_way():
    unknown = Instants("rig", 1)
    unknown.receive(silhouette("1", START_NS, START_NS + MS))
    assert unknown.receive(pose(START_NS, START_NS + 2 * MS)) is None
    assert with_clock(Instants("rig", 1)).receive(pose(START_NS, START_NS + 2 * MS)) is None


def test_names_from_the_network_are_kept_up_to_a_limit():
    instants = with_clock(Instants("rig", 1))
    for k in range(2000):
        instants.receive(silhouette(f"v{k}", START_NS, START_NS + MS))
    way = instants.receive(pose(START_NS, START_NS + 2 * MS))
    assert way is not None
    assert len(way.parts) <= 3 * 64 + 1
