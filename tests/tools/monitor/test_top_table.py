"""Table of `top`: figures and status of each service."""

from collections.abc import Mapping

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault, Health
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.monitor.table import KEPT_RATES, MAX_SERVICES, Network, Row

S = 1_000_000_000


def health(ns: int, rate: float = 15.0, counts: Mapping[str, int] | None = None, id: str = "1") -> Envelope:
    message = Health(
        frame=0, captured_ns=ns, service="viewer", id=id, state="tracking", rate=rate,
        stages_ms={"step_frame": 2.5, "step_assignment": 1.0, "frame_age": 7.0}, counts=dict(counts or {}),
        clock_offset_ns=-2_000_000, clock_error_ns=500_000, memory_bytes=123_000_000, cores=0.25, busy=0.5,
    )  # fmt: skip
    return Envelope(HEALTH.at("r", service="viewer", id=id), HEALTH, message, ns)


def row(network: Network, now_ns: int) -> Row:
    (found,) = network.rows(now_ns)
    return found


def test_row_shows_the_values_of_the_health_message() -> None:
    network = Network().updated("r", Alive("viewer", "1", True, 0)).updated("r", health(S))
    found = row(network, S)
    assert (found.rig, found.title, found.status, found.rate, found.words) == ("r", "viewer 1", "up", 15.0, "tracking")
    assert (found.latency_ms, found.stage) == (7.0, "frame 2.5")
    assert (found.offset_ms, found.error_ms) == (-2.0, 0.5)
    assert (found.memory_mb, found.cores, found.busy) == (123.0, 0.25, 0.5)


def test_row_has_the_days_of_the_certificate() -> None:
    assert row(Network().updated("r", health(S)), S).certificate_days is None
    assert row(Network().updated("r", health(S, counts={"certificate_days": 12})), S).certificate_days == 12


def test_status_depends_on_token_and_health() -> None:
    network = Network().updated("r", Alive("viewer", "1", True, 0))
    assert row(network, S).status == "starting"
    network = network.updated("r", health(S))
    assert row(network, 2 * S).status == "up"
    assert row(network, 5 * S).status == "silent"  # frozen: its token still exists
    network = network.updated("r", Alive("viewer", "1", False, 2 * S))
    assert row(network, 3 * S).status == "gone"
    network = network.updated("r", Alive("viewer", "1", True, 9 * S)).updated("r", health(9 * S))
    assert row(network, 9 * S).status == "up"


def test_health_without_a_liveliness_token_is_accepted() -> None:
    network = Network().updated("r", health(S))
    assert row(network, S).status == "up"
    assert row(network, 5 * S).status == "gone"


def test_expected_service_without_messages_is_missing() -> None:
    network = Network({"r": [("viewer", "1"), ("integrator", "main")]}).updated("r", health(S))
    assert [(row.title, row.status) for row in network.rows(S)] == [("viewer 1", "up"), ("integrator", "missing")]


def test_losses_are_counted_in_total_and_for_the_last_second() -> None:
    network = Network().updated("r", health(S, counts={"dropped_frames": 4, "frames": 100, "dropped_superseded": 9}))
    assert (row(network, S).lost, row(network, S).lately, row(network, S).superseded) == (4, 0, 9)
    network = network.updated("r", health(2 * S, counts={"dropped_frames": 6, "step_errors": 1}))
    assert (row(network, 2 * S).lost, row(network, 2 * S).lately) == (7, 3)
    network = network.updated("r", health(3 * S, counts={}))  # it was started again
    assert (row(network, 3 * S).lost, row(network, 3 * S).lately) == (0, 0)


def test_only_the_newest_rates_are_kept() -> None:
    network = Network()
    for second in range(2 * KEPT_RATES):
        network = network.updated("r", health(second * S, rate=float(second)))
    assert row(network, 0).rates == tuple(float(second) for second in range(KEPT_RATES, 2 * KEPT_RATES))


def test_rows_are_ordered_by_rig_kind_and_number() -> None:
    network = Network({"r": [("integrator", "main")]})
    for id in ("10", "2"):
        network = network.updated("r", health(S, id=id))
    network = network.updated("a", health(S))
    assert [(row.rig, row.title) for row in network.rows(S)] == [
        ("a", "viewer 1"), ("r", "viewer 2"), ("r", "viewer 10"), ("r", "integrator"),
    ]  # fmt: skip


def test_invented_services_are_bounded_and_displace_none_of_the_rig() -> None:
    network = Network({"r": [("viewer", "1"), ("integrator", "main")]})
    for number in range(2 * MAX_SERVICES):
        network = network.updated("r", Alive("viewer", f"unknown{number}", True, 0))
        network = network.updated("r", health(S, id=f"invented{number}"))
    network = network.updated("r", health(S)).updated("r", Alive("integrator", "main", True, S))
    rows = list(network.rows(S))
    assert len(rows) <= MAX_SERVICES + 2
    assert {"viewer 1", "integrator"} <= {row.title for row in rows}


def test_row_has_the_faults_of_the_images() -> None:
    fault = CameraFault(code=AdviceCode.FOCUS, value=6.0, limit=3.5, unit="px")
    network = Network().updated("r", health(S))
    assert row(network, S).advice == ""
    for faults, expected in (([fault], "focus"), ([], "")):
        advice = CameraAdvice(frame=0, captured_ns=S, viewer="1", faults=faults)
        network = network.updated("r", Envelope(CAMERA_ADVICE.at("r", viewer="1"), CAMERA_ADVICE, advice, S))
        assert row(network.updated("r", health(S)), S).advice == expected
