"""Losses of a live take: each kind is found in a take made without it."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from benchmarks.live_losses import Account, account, content, window
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Handled, Health, Message, Silhouette, TrackerPose
from zenocap.common.runtime.input_trace import FRAME, TICK
from zenocap.common.topics import SILHOUETTE, topic_of
from zenocap.services.tracker.states import Options, Setup

RIG, FPS, PERIOD_NS, COUNT = "rig", 50.0, 20_000_000, 40
VIEWERS = ("1", "2")
SETUP = Setup(FOURTEEN_PARTS, dict(zip(VIEWERS, paper_cameras(), strict=True)), PERIOD_NS, None, Options())


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

    untracked: frames without a tick; the last of them waits for the next tick.  counted: `dropped_instants`.
    """
    found = [silhouette(viewer, k) for k in range(COUNT) for viewer in VIEWERS if viewer == "1" or k not in unlogged]
    found += [pose(k) for k in range(COUNT) if k not in untracked[:-1]]
    found += [handled("viewer", viewer, [(FRAME, k * PERIOD_NS) for k in range(COUNT)]) for viewer in VIEWERS]
    events = []
    for k in range(COUNT):
        seen_by = [viewer for viewer in VIEWERS if viewer == "1" or k not in undelivered]
        events += [(SILHOUETTE.at(RIG, viewer=viewer), k * PERIOD_NS) for viewer in seen_by]
        events += [] if k in untracked else [(TICK, k * PERIOD_NS)]
    after = [(SILHOUETTE.at(RIG, viewer="1"), COUNT * PERIOD_NS)] * 20  # after the last health: not counted
    found += [handled("tracker", "main", events[:50]), handled("tracker", "main", events[50:], 1, 50, 1)]
    found += [handled("tracker", "main", after, 2, len(events), 2)]
    return [
        *found,
        health("tracker", "main", {"dropped_instants": counted, "whole_instants": COUNT}),
        health("integrator", "main", {"log_lost": 0}),
    ]


def loss(received: Sequence[Envelope]) -> Account:
    return account(content(received, RIG), SETUP)


def test_a_complete_take_has_lost_nothing() -> None:
    found = loss(messages())
    assert found.fates.tracked == set(range(COUNT))
    assert not found.fates.dropped | found.fates.waiting | found.fates.single | found.fates.unpaired
    assert found.problems == []


def test_instants_that_are_counted_as_dropped_are_allowed() -> None:
    found = loss(messages(untracked=range(10, 30), counted=19))
    assert found.fates.dropped == set(range(10, 29))
    assert found.fates.waiting == {COUNT - 1}
    assert found.problems == []


def test_instants_that_are_not_counted_are_a_problem() -> None:
    found = loss(messages(untracked=range(10, 30), counted=18))
    assert found.problems == ["tracker main: dropped_instants 18 instead of 19"]


def test_a_processed_instant_without_a_pose_is_a_problem() -> None:
    every = [one for one in messages() if one.message != pose(7).message]
    assert loss(every).problems == ["1 without pose"]


def test_a_message_that_the_log_or_the_tracker_lacks_is_a_problem() -> None:
    assert "1 unlogged" in loss(messages(unlogged=(7,))).problems
    found = loss(messages(undelivered=(7, 9)))
    assert "2 undelivered" in found.problems
    assert found.fates.single == {7, 9}


@pytest.mark.parametrize("name", ["log_lost", "dropped_queue_full", "step_errors"])
def test_counted_losses_of_messages_are_a_problem(name: str) -> None:
    found = loss([*messages(), health("integrator", "main", {name: 3, "dropped_superseded": 9})])
    assert found.problems == [f"integrator main: {name} 3"]


def test_a_restart_and_a_missing_trace_are_problems() -> None:
    again = handled("tracker", "main", [], 3, 0)
    assert loss([*messages(), again]).problems == ["1 restarts"]
    complete = content(messages(), RIG)
    del complete.traces["tracker", "main"][1]
    assert "1 trace gaps" in account(complete, SETUP).problems


def test_latency_is_from_capture_to_log_inside_the_window() -> None:
    take = content(messages(unlogged=(3,), untracked=(4, 25)), RIG)
    found = window(take, 0, 10 * PERIOD_NS, FPS)
    assert (found.due, found.seen, found.poses) == (10, 9, 9)
    assert found.latency_ms == pytest.approx((5.0, 5.0, 5.0))
    assert window(replace(take, poses={}), 0, PERIOD_NS, FPS).poses == 0
