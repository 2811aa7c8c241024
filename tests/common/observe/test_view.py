"""View of a rig: figures and status of each service."""

from collections.abc import Mapping

from zenocap.common.bus.protocol import Alive, Envelope, Received
from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault, FrameRate, Health
from zenocap.common.observe.view import KEPT_RATES, MOST_OTHERS, ObservedService, RigView, observed, rows
from zenocap.common.topics import CAMERA_ADVICE, FRAME_RATE, HEALTH

S = 1_000_000_000


def health(ns: int, rate: float = 15.0, counts: Mapping[str, int] | None = None, id: str = "1") -> Envelope:
    message = Health(
        frame=0, captured_ns=ns, service="viewer", id=id, state="tracking", rate=rate,
        stages_ms={"step_frame": 2.5, "step_assignment": 1.0, "frame_age": 7.0}, counts=dict(counts or {}),
        clock_offset_ns=-2_000_000, clock_error_ns=500_000, memory_bytes=123_000_000, cores=0.25, busy=0.5,
    )  # fmt: skip
    return Envelope(HEALTH.at("r", service="viewer", id=id), HEALTH, message, ns)


def row(view: RigView, now_ns: int) -> ObservedService:
    (found,) = rows(view, now_ns)
    return found


def after(*events: Received, view: RigView | None = None) -> RigView:
    """The view after events, each received at its time."""
    view = view or RigView("r")
    for event in events:
        view = observed(view, event, event.received_ns)
    return view


def test_row_shows_the_values_of_the_health_message() -> None:
    view = after(Alive("viewer", "1", True, 0), health(S))
    found = row(view, S)
    assert (found.rig, found.title, found.status, found.rate, found.words) == ("r", "viewer 1", "up", 15.0, "tracking")
    assert (found.latency_ms, found.stage) == (7.0, "frame 2.5")
    assert (found.offset_ms, found.error_ms) == (-2.0, 0.5)
    assert (found.memory_mb, found.cores, found.busy) == (123.0, 0.25, 0.5)


def test_row_has_the_days_of_the_certificate() -> None:
    assert row(after(health(S)), S).certificate_days is None
    assert row(after(health(S, counts={"certificate_days": 12})), S).certificate_days == 12


def test_status_depends_on_token_and_health() -> None:
    view = after(Alive("viewer", "1", True, 0))
    assert row(view, S).status == "starting"
    view = after(health(S), view=view)
    assert row(view, 2 * S).status == "up"
    assert row(view, 5 * S).status == "silent"  # frozen: its token still exists
    view = after(Alive("viewer", "1", False, 2 * S), view=view)
    assert row(view, 3 * S).status == "gone"
    view = after(Alive("viewer", "1", True, 9 * S), health(9 * S), view=view)
    assert row(view, 9 * S).status == "up"


def test_health_without_a_liveliness_token_is_accepted() -> None:
    view = after(health(S))
    assert row(view, S).status == "up"
    assert row(view, 5 * S).status == "gone"


def test_expected_service_without_messages_is_missing() -> None:
    view = after(health(S), view=RigView("r", (("viewer", "1"), ("integrator", "main"))))
    assert [(row.title, row.status) for row in rows(view, S)] == [("viewer 1", "up"), ("integrator", "missing")]


def test_losses_are_counted_in_total_and_for_the_last_second() -> None:
    view = after(health(S, counts={"dropped_frames": 4, "frames": 100, "dropped_superseded": 9}))
    assert (row(view, S).lost, row(view, S).lately, row(view, S).superseded) == (4, 0, 9)
    view = after(health(2 * S, counts={"dropped_frames": 6, "step_errors": 1}), view=view)
    assert (row(view, 2 * S).lost, row(view, 2 * S).lately) == (7, 3)
    view = after(health(3 * S, counts={}), view=view)  # it was started again
    assert (row(view, 3 * S).lost, row(view, 3 * S).lately) == (0, 0)


def test_only_the_newest_rates_are_kept() -> None:
    view = RigView("r")
    for second in range(2 * KEPT_RATES):
        view = after(health(second * S, rate=float(second)), view=view)
    assert row(view, 0).rates == tuple(float(second) for second in range(KEPT_RATES, 2 * KEPT_RATES))


def test_rows_are_ordered_by_kind_and_number() -> None:
    view = after(health(S, id="10"), health(S, id="2"), view=RigView("r", (("integrator", "main"),)))
    assert [row.title for row in rows(view, S)] == ["viewer 2", "viewer 10", "integrator"]


def test_a_wall_clock_that_is_set_changes_no_status() -> None:
    """Set back by an hour, it would keep a service up that has stopped."""
    view = observed(observed(RigView("r"), Alive("viewer", "1", True, 7200 * S), 10 * S), health(3600 * S), 11 * S)
    assert row(view, 12 * S).status == "up"
    assert row(view, 15 * S).status == "silent"


def test_what_changes_nothing_gives_the_same_object() -> None:
    view = after(health(S))
    rate = FrameRate(frame=1, captured_ns=2, keep=1, of=1, from_ns=2, phase_ns=0, fps=30.0)
    other = Envelope(FRAME_RATE.at("r"), FRAME_RATE, rate, S)
    assert observed(view, other, S) is view


def test_invented_services_are_bounded_and_displace_none_of_the_rig() -> None:
    view = RigView("r", (("viewer", "1"), ("integrator", "main")))
    for number in range(2 * MOST_OTHERS):
        view = after(Alive("viewer", f"unknown{number}", True, 0), view=view)
        view = after(health(S, id=f"invented{number}"), view=view)
    view = after(health(S), Alive("integrator", "main", True, S), view=view)
    found = rows(view, S)
    assert len(found) == MOST_OTHERS + 2
    assert view.ignored > 0
    assert {"viewer 1", "integrator"} <= {row.title for row in found}


def test_row_has_the_faults_of_the_images() -> None:
    fault = CameraFault(code=AdviceCode.FOCUS, value=6.0, limit=3.5, unit="px")
    view = after(health(S))
    assert row(view, S).advice == ""
    for faults, expected in (([fault], "focus"), ([], "")):
        advice = CameraAdvice(frame=0, captured_ns=S, viewer="1", faults=faults)
        view = after(Envelope(CAMERA_ADVICE.at("r", viewer="1"), CAMERA_ADVICE, advice, S), view=view)
        assert row(after(health(S), view=view), S).advice == expected
