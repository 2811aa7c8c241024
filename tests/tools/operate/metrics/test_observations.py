"""Observations of rigs: what is counted, what is admitted, latency and skew on the integrator's clock."""

import pytest
from msgspec import structs

from tests.support.animator_stand_in import health, received
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, RoundTrip
from zenocap.common.topics import SILHOUETTE
from zenocap.tools.operate.metrics.observations import Observations, RigObservations
from zenocap.tools.operate.metrics.parameters import FORGET_NS, LATENCY_BUCKETS_S, MAX_RIGS, MAX_SERVICES

MS, S = 1_000_000, 1_000_000_000
NOW_NS = 1_700_000_000 * S
EXPECTED = (("viewer", "1"), ("viewer", "2"), ("tracker", "main"))


def pose(captured_ns: int, *, lost: bool = False) -> m.TrackerPose:
    return built(m.TrackerPose, captured_ns=captured_ns, position=(0, 1, 0), position_spread=(0, 0, 0), lost=lost)


def traced(events: list[tuple[str, int]]) -> m.Handled:
    """Input trace of the tracker: silhouettes by viewer and capture time."""
    keys = [SILHOUETTE.at("studio", viewer=viewer) for viewer in ("1", "2", "3")]
    return m.Handled(
        frame=0, captured_ns=NOW_NS, service="tracker", id="main", first=0, keys=keys,
        events=[(int(viewer) - 1, time_ns) for viewer, time_ns in events],
    )  # fmt: skip


class Observed(RigObservations):
    """A rig whose messages arrive at one time."""

    def __init__(self, expected: tuple[tuple[str, str], ...] = EXPECTED) -> None:
        super().__init__("studio", expected)

    def gets(self, *messages: m.Message, now_ns: int = NOW_NS) -> None:
        for message in messages:
            self.receive(received(message, now_ns, "studio"), now_ns)


def test_latency_is_on_the_integrators_clock() -> None:
    observed = Observed()
    offset_ns = 7 * S  # this clock is ahead
    observed.receive(RoundTrip(NOW_NS, NOW_NS + MS // 2 - offset_ns, NOW_NS + MS), NOW_NS)
    observed.gets(*(pose(NOW_NS - offset_ns - age_ns, lost=lost) for age_ns, lost in ((12 * MS, False), (28 * MS, True))))
    assert observed.poses == {("tracker", False): 1, ("tracker", True): 1}
    histogram = observed.latency["tracker"]
    assert [bound for bound, count in zip(LATENCY_BUCKETS_S, histogram.counts, strict=False) if count] == [0.015, 0.03]
    assert histogram.sum_s == pytest.approx(0.040)


def test_a_pose_of_both_passes_is_another_one_of_a_pose_that_is_counted() -> None:
    """As a replay of a take that was tracked both ways publishes them."""
    observed = Observed()
    observed.receive(RoundTrip(NOW_NS, NOW_NS, NOW_NS + 1), NOW_NS)
    first = pose(NOW_NS)
    observed.gets(first, m.BothWaysPose(**structs.asdict(first), backward={}))
    assert observed.poses == {("tracker", False): 1}
    assert sum(observed.latency["tracker"].counts) == 1


@pytest.mark.parametrize("known", [False, True])
def test_poses_have_no_latency_without_a_clock_and_from_a_replayed_take(known: bool) -> None:
    observed = Observed()
    if known:
        observed.receive(RoundTrip(NOW_NS, NOW_NS, NOW_NS + MS), NOW_NS)
    observed.gets(pose(NOW_NS - (3600 * S if known else 20 * MS)))
    assert observed.poses["tracker", False] == 1
    assert observed.latency == {}


def test_a_latency_beyond_the_last_bound_is_counted() -> None:
    observed = Observed()
    observed.receive(RoundTrip(NOW_NS, NOW_NS, NOW_NS + 1), NOW_NS)
    observed.gets(pose(NOW_NS - 30 * S))
    assert observed.latency["tracker"].counts == [0] * len(LATENCY_BUCKETS_S) + [1]


def test_skew_is_the_distance_of_capture_times_after_correction_of_the_clocks() -> None:
    observed = Observed()
    observed.gets(health("viewer", "1", NOW_NS), health("viewer", "2", NOW_NS))
    period = 33 * MS
    events = [("1", NOW_NS + k * period) for k in range(30)] + [("2", NOW_NS + 5 * MS + k * period) for k in range(30)]
    observed.gets(traced(events))
    assert observed.skews_s() == pytest.approx({"1": 0.0, "2": 0.005})  # both clocks have the same offset

    late = [(viewer, time_ns + (28 - 5) * MS) if viewer == "2" else (viewer, time_ns) for viewer, time_ns in events]
    observed.gets(traced(late))
    assert observed.skews_s()["2"] == pytest.approx(-0.005)  # 28 ms late of 33 is 5 ms early for the next


def test_traces_of_unknown_viewers_and_other_services_have_no_skew() -> None:
    observed = Observed()
    observed.gets(health("viewer", "1", NOW_NS), traced([("1", NOW_NS), ("3", NOW_NS)]))
    assert observed.skews_s() == {}


def test_services_beyond_the_limit_and_of_unknown_names_are_counted_and_not_kept() -> None:
    observed = Observed(())
    for k in range(3 * MAX_SERVICES):
        observed.gets(health("viewer", f"v{k}", NOW_NS), health(f"evil{k}", "main", NOW_NS))
        observed.receive(Alive("viewer", f"a{k}", True, NOW_NS), NOW_NS)
    assert len(observed.services()) == MAX_SERVICES
    assert observed.ignored == 3 * 3 * MAX_SERVICES - MAX_SERVICES


def test_services_of_the_rig_file_are_admitted_when_the_limit_is_reached() -> None:
    observed = Observed()
    observed.gets(*(health("viewer", f"v{k}", NOW_NS) for k in range(2 * MAX_SERVICES)))
    observed.gets(health("tracker", "main", NOW_NS))
    assert ("tracker", "main") in observed.services()
    later_ns = NOW_NS + FORGET_NS + S
    observed.gets(health("recorder", "new", later_ns), now_ns=later_ns)
    assert set(observed.services()) == {("tracker", "main"), ("recorder", "new")}  # the silent ones have been removed


@pytest.mark.parametrize("id", ["", "a b", "x" * 65, "a\n"])
def test_tokens_with_an_impossible_id_are_ignored(id: str) -> None:
    observed = Observed(())
    observed.receive(Alive("viewer", id, True, NOW_NS), NOW_NS)
    assert (observed.services(), observed.ignored) == ({}, 1)


def test_rigs_that_are_found_are_limited_and_have_valid_names() -> None:
    observed = Observations({})
    assert observed.admit(["b", "a", "no name", "x" * 65]) == ["a", "b"]
    assert len(observed.admit([f"rig{k}" for k in range(3 * MAX_RIGS)])) == MAX_RIGS - 2
    assert len(observed.rigs) == MAX_RIGS
    assert observed.ignored == 2 + 3 * MAX_RIGS - (MAX_RIGS - 2)
