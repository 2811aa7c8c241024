"""Losses of a live take: each kind is found in a take that was made without it, and whole instants are allowed."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from benchmarks.live_losses import WAITING, account, content, window
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Handled, Health, Message, Silhouette, TrackerPose
from zenocap.common.runtime.input_trace import FRAME, TICK
from zenocap.common.topics import SILHOUETTE, topic_of

RIG, FPS, PERIOD_NS, COUNT = "rig", 50.0, 20_000_000, 40
VIEWERS = ("1", "2")


def envelope(message: Message, received_ns: int) -> Envelope:
    topic = topic_of(type(message))
    return Envelope(topic.at(RIG, **topic.names_of(message)), topic, message, received_ns)


def handled(
    service: str, id: str, events: Sequence[tuple[str, int]], number: int = 0, first: int = 0, captured_ns: int = 0
) -> Envelope:
    keys = list(dict.fromkeys(key for key, _ in events))
    trace = Handled(
        frame=number, captured_ns=captured_ns, service=service, id=id, first=first, keys=keys,
        events=[(keys.index(key), time_ns) for key, time_ns in events],
    )  # fmt: skip
    return envelope(trace, 0)


def health(service: str, id: str, counts: dict[str, int]) -> Envelope:
    return envelope(
        Health(frame=0, captured_ns=1, service=service, id=id, state="", rate=0.0, stages_ms={}, counts=counts), 0
    )


def silhouette(viewer: str, frame: int) -> Envelope:
    message = Silhouette(
        frame=frame, captured_ns=frame * PERIOD_NS, viewer=viewer, size=(4, 4), region=(0, 0, 0, 0), data=b""
    )
    return envelope(message, frame * PERIOD_NS + 1_000_000)


def pose(frame: int) -> Envelope:
    message = TrackerPose(
        frame=frame, captured_ns=frame * PERIOD_NS, position=(0.0, 0.0, 0.0), angles={}, position_spread=(0.0, 0.0, 0.0),
        spread={}, likelihood=0.0, effective=0.0, lost=False, views=[],
    )  # fmt: skip
    return envelope(message, frame * PERIOD_NS + 5_000_000)


def messages(
    unlogged: Sequence[int] = (), undelivered: Sequence[int] = (), untracked: Sequence[int] = (), counted: int = 0
) -> list[Envelope]:
    """Of two viewers and the tracker.  unlogged, undelivered: frames of viewer 2 that the log, the tracker lack.

    untracked: frames without a tick.  counted: `dropped_instants`.
    """
    found = [silhouette(viewer, k) for k in range(COUNT) for viewer in VIEWERS if viewer == "1" or k not in unlogged]
    found += [pose(k) for k in range(COUNT) if k not in untracked]
    found += [handled("viewer", viewer, [(FRAME, k * PERIOD_NS) for k in range(COUNT)]) for viewer in VIEWERS]
    events = []
    for k in range(COUNT):
        seen_by = [viewer for viewer in VIEWERS if viewer == "1" or k not in undelivered]
        events += [(SILHOUETTE.at(RIG, viewer=viewer), k * PERIOD_NS) for viewer in seen_by]
        events += [] if k in untracked else [(TICK, k * PERIOD_NS)]
    after = [(SILHOUETTE.at(RIG, viewer="1"), COUNT * PERIOD_NS)] * 20  # after the last health: not counted
    found += [handled("tracker", "main", events[:50]), handled("tracker", "main", events[50:], 1, 50, 1)]
    found += [handled("tracker", "main", after, 2, len(events), 2)]
    return [*found, health("tracker", "main", {"dropped_instants": counted}), health("integrator", "main", {"log_lost": 0})]


def test_a_complete_take_has_lost_nothing() -> None:
    found = account(content(messages(), RIG))
    assert (found.instants, found.tracked, found.dropped, found.waiting) == (COUNT, COUNT, 0, 0)
    assert found.problems == []


def test_instants_that_are_counted_as_dropped_are_allowed() -> None:
    found = account(content(messages(untracked=range(10, 30), counted=20), RIG))
    assert (found.tracked, found.dropped, found.waiting) == (20, 20, 0)
    assert found.problems == []


def test_instants_that_are_not_counted_are_a_problem() -> None:
    found = account(content(messages(untracked=range(10, 30), counted=19 - WAITING), RIG))
    assert found.problems == [f"{WAITING + 1} instants neither tracked nor counted"]


def test_a_message_that_the_log_or_the_tracker_lacks_is_a_problem() -> None:
    assert account(content(messages(unlogged=(7,)), RIG)).problems == ["1 unlogged"]
    assert account(content(messages(undelivered=(7, 9)), RIG)).problems == ["2 undelivered"]


@pytest.mark.parametrize("name", ["log_lost", "dropped_queue_full", "step_errors"])
def test_counted_losses_of_messages_are_a_problem(name: str) -> None:
    found = account(content([*messages(), health("integrator", "main", {name: 3, "dropped_superseded": 9})], RIG))
    assert found.problems == [f"3 integrator: {name}"]


def test_a_restart_and_a_missing_trace_are_problems() -> None:
    again = handled("tracker", "main", [], 3, 0)
    assert account(content([*messages(), again], RIG)).problems == ["1 restarts"]
    complete = content(messages(), RIG)
    del complete.traces["tracker", "main"][1]
    assert "1 trace gaps" in account(complete).problems


def test_latency_is_from_capture_to_log_inside_the_window() -> None:
    take = content(messages(unlogged=(3,), untracked=(4, 25)), RIG)
    found = window(take, 0, 10 * PERIOD_NS, FPS)
    assert (found.due, found.seen, found.poses) == (10, 9, 9)
    assert found.latency_ms == pytest.approx((5.0, 5.0, 5.0))
    assert window(replace(take, poses={}), 0, PERIOD_NS, FPS).poses == 0
