"""Step of the integrator beside a tracker: frame rate, camera delays.  Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.messages import CameraDelays, Health, Message, Silhouette
from zenocap.common.runtime.clock_offset import offset_in
from zenocap.common.topics import CAMERA_DELAYS, FRAME_RATE, Topic
from zenocap.services.integrator import camera_delays, rate_control
from zenocap.services.integrator.camera_delays import DelaySetup, DelayState
from zenocap.services.integrator.rate_reports import RateSetup, RateState

Event: TypeAlias = FrameLike | Envelope | Alive | Tick


@dataclass(frozen=True)
class TimekeeperSetup:
    """delays: None for a rig with `delays = "off"`."""

    rate: RateSetup
    delays: DelaySetup | None = None


@dataclass(frozen=True)
class TimekeeperState:
    """State of both parts."""

    rate: RateState = field(default_factory=RateState)
    delays: DelayState = field(default_factory=DelayState)


def step(setup: TimekeeperSetup, state: TimekeeperState, event: Event) -> tuple[TimekeeperState, list[Message]]:
    """Process one event: (state, messages).  Pure."""
    match event:
        case Envelope(message=Silhouette() as silhouette):
            if setup.delays is None or _yields(setup.delays, state.rate):
                return state, []
            return replace(state, delays=camera_delays.collect(setup.delays, state.delays, silhouette)), []
        case Envelope(message=CameraDelays() as message):
            if setup.delays is None:
                return state, []
            if not camera_delays.awaits_recovery(state.delays):
                return replace(state, delays=camera_delays.note_other(setup.delays, state.delays, message)), []
            delays, messages = camera_delays.resume(setup.delays, state.delays, message)
            return replace(state, delays=delays), messages
        case _:
            rate, messages = rate_control.step(setup.rate, state.rate, event)
    delays = state.delays
    match event:
        case Envelope(message=Health(service="viewer") as health) if setup.delays and health.id in setup.delays.cameras:
            offset = offset_in(health)
            if offset is not None:
                delays = replace(delays, offsets={**delays.offsets, health.id: offset})
        case Tick(received_ns=now_ns) if setup.delays is not None:
            delays, more = camera_delays.decide(setup.delays, delays, now_ns)
            messages = [*messages, *more]
    return TimekeeperState(rate, delays), messages


def _yields(setup: DelaySetup, rate: RateState) -> bool:
    """Whether delays that are only reported wait, because the machines cannot process all frames."""
    return rate.rate.level > 0 and not setup.follow


def describe(setup: TimekeeperSetup, state: TimekeeperState) -> str:
    """Health text; empty at full rate without late cameras."""
    late = camera_delays.describe(setup.delays, state.delays) if setup.delays else ""
    return "; ".join(filter(None, (rate_control.describe(state.rate), late)))


def counts(state: TimekeeperState) -> Mapping[str, int]:
    """Counts for the health."""
    return camera_delays.counts(state.delays)


def recovers(setup: TimekeeperSetup, state: TimekeeperState) -> tuple[Topic, ...]:
    """Topics whose last message from before a restart is needed."""
    rate = (FRAME_RATE,) if rate_control.awaits_recovery(state.rate) else ()
    return (*rate, CAMERA_DELAYS) if setup.delays and camera_delays.awaits_recovery(state.delays) else rate
