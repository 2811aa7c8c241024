"""The animator process: read the rig, open the bus, serve the page, run."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Never

from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.live_smoothing import animator_smoothing
from zenocap.common.messages import Message
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.priority import lower_priority
from zenocap.common.runtime.service import Event, Service, TopicSubscription, run
from zenocap.common.runtime.service_info import service_info
from zenocap.common.vision.threads import use_one_thread
from zenocap.services.animator.outputs.output_group import has_outputs, open_outputs
from zenocap.services.animator.page_bridge import PageBridge
from zenocap.services.animator.parameters import TICK_NS
from zenocap.services.animator.states import TOPICS, AnimatorSetup, AnimatorState
from zenocap.services.animator.step import counts, describe, phase_of, step

logger = logging.getLogger(__name__)

ID = "main"


def animator_service(
    rig: Rig, health_text: Callable[[], str] = lambda: "", on_event: Callable[[Event[Never]], None] = lambda _: None
) -> Service[AnimatorSetup, AnimatorState, Never]:
    """Return the service of a rig's animator.

    health_text: appended to its health.  on_event: is called with every event before the step, poses smoothed if the rig
    has it so.
    """
    smoothing = animator_smoothing(rig.animator)

    def observed_step(
        setup: AnimatorSetup, state: AnimatorState, event: Event[Never]
    ) -> tuple[AnimatorState, Sequence[Message]]:
        if isinstance(event, Envelope) and smoothing is not None:
            event = replace(event, message=smoothing.message(event.message))
        on_event(event)
        return step(setup, state, event)

    return Service(
        "animator", ID, AnimatorSetup(tuple(viewer.id for viewer in rig.viewers)), AnimatorState, observed_step,
        tuple(TopicSubscription(topic) for topic in TOPICS), lambda state: f"{describe(state)}{health_text()}", counts,
        phase_of, watch_alive=True, tick_ns=TICK_NS, derives=False,
    )  # fmt: skip


def run_animator(rig: Rig, takes: Path, options: ZenohOptions, stopped: Callable[[], bool]) -> int:
    """Run until `stopped`; return the exit status.  takes: folder of the takes that the page can play.

    Without outputs, to which poses must be sent in time, it has a lower priority than the other services.  Raises UserError
    and ValueError at start.
    """
    if not has_outputs(rig.animator):
        lower_priority(logger)
    use_one_thread()
    clock = RealClock()
    with ZenohBus.open(options, rig.name, clock, stopped, services_of(rig)) as bus:
        bus.serve_service_info(service_info(rig, "animator", ID, clock.now_ns()))
        bridge = PageBridge(rig, bus, clock, open_outputs(rig.animator, rig.name, clock))
        try:
            if rig.animator.page.enabled:
                bridge.open(rig.animator.page, takes, TOPICS)
            service = animator_service(rig, bridge.health_text, bridge.receive)
            return run(
                service, bus, clock, stopped=stopped, extra_counts=bridge.counts, requested=bridge.requests,
                on_state=bridge.show,
            )  # fmt: skip
        finally:
            bridge.close()
