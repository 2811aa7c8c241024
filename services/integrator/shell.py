"""Process of the integrator: rig, bus, log, service loop."""

import logging
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Never, cast

from msgspec import UNSET

from zenocap.common import topics as t
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import limb_angles, limb_directions
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import UniversalBap
from zenocap.common.recording.log import Log
from zenocap.common.recording.opening import new_parts
from zenocap.common.recording.parts import take_path
from zenocap.common.recording.setup_file import Parameters, RecordedRig, recorded_rig
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.runtime.service import Service, TopicSubscription, new_pose_service, run
from zenocap.common.runtime.service_info import service_info
from zenocap.common.runtime.signals import loading
from zenocap.services.integrator import rate_control, timekeeper
from zenocap.services.integrator.camera_delays import DelaySetup
from zenocap.services.integrator.log_control import LogControl
from zenocap.services.integrator.parameters import DECISION_NS
from zenocap.services.integrator.rate_reports import RateSetup
from zenocap.services.integrator.states import IntegratorSetup, IntegratorState, integrator_setup
from zenocap.services.integrator.step import awaits_recovery, counts, describe, initial_state, phase_of, step
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState

ID = "main"
LOSS = 3  # exit status: completed, but the log is incomplete


def integrator_service(rig: Rig) -> Service[IntegratorSetup, IntegratorState, Never]:
    """Integrator of a rig.  Raises ValueError for cameras that do not suit the method."""
    return service_of(setup_of(recorded_rig(rig)))


def service_of(setup: IntegratorSetup) -> Service[IntegratorSetup, IntegratorState, Never]:
    """Service of the integrator of a method whose viewers run the exchange of [Two-view]."""
    topics = (t.SIGHTING, t.PARTIAL_BDP, t.PARTIAL_BAP, t.REQUEST, t.FRAME_RATE, t.UNIVERSAL_BDP)
    return Service(
        "integrator", ID, setup, partial(initial_state, setup), step,
        (*map(TopicSubscription, topics), TopicSubscription(t.HEALTH, names={"service": "viewer"})), describe,
        counts, phase_of, result=UniversalBap, tick_ns=DECISION_NS, recovers=_recovers, keeps_time=True,
        load=lambda: limb_angles(TEN_PARTS, limb_directions(TEN_PARTS, TEN_PARTS.neutral), TEN_PARTS.neutral),
    )  # fmt: skip


def _recovers(state: IntegratorState) -> tuple[t.Topic, ...]:
    pose = (t.UNIVERSAL_BDP, t.UNIVERSAL_BAP) if awaits_recovery(state) else ()
    return (*pose, t.FRAME_RATE) if rate_control.awaits_recovery(state.rate) else pose


def timekeeper_service(rig: Rig) -> Service[TimekeeperSetup, TimekeeperState, Never]:
    """Integrator of a rig with a tracker alone: clock, frame rate under overload, delays of the cameras, and the log."""
    return timekeeper_of(recorded_rig(rig))


def timekeeper_of(rig: RecordedRig) -> Service[TimekeeperSetup, TimekeeperState, Never]:
    """The same of a rig that was recorded in a take."""
    text = f"method {rig.method}: clock and log; the pose comes from the tracker"
    corrected = "report" if rig.delays is UNSET else rig.delays
    delays = None if corrected == "off" else DelaySetup(rig.cameras(), rig.frame_ns(), corrected == "follow")
    rate = RateSetup(tuple(viewer.id for viewer in rig.viewers), 1e9 / rig.frame_ns(), method_of(rig.method).has_tracker)
    setup = TimekeeperSetup(rate, delays)

    def describe_timekeeper(state: TimekeeperState) -> str:
        more = timekeeper.describe(setup, state)
        return f"{text}; {more}" if more else text

    return Service(
        "integrator", ID, setup, TimekeeperState, timekeeper.step,
        (
            *(TopicSubscription(t.HEALTH, names={"service": name}) for name in ("viewer", "tracker")),
            *(TopicSubscription(topic) for topic in (t.FRAME_RATE, t.TRACKER_DETAIL)),
            *(() if setup.delays is None else (TopicSubscription(t.CAMERA_DELAYS), TopicSubscription(t.SILHOUETTE))),
        ),
        describe_timekeeper, timekeeper.counts, tick_ns=DECISION_NS,
        recovers=lambda state: timekeeper.recovers(setup, state), keeps_time=True,
    )  # fmt: skip


def warn_of_others(once: OncePerSource, state: object) -> None:
    """Log the first decision of another program that viewers or tracker may have followed until it is contradicted."""
    found = {
        "frame rate": isinstance(state, IntegratorState | TimekeeperState) and state.rate.repeats > 0,
        "delays of cameras": isinstance(state, TimekeeperState) and state.delays.contradicted,
        "body": isinstance(state, IntegratorState) and state.contradicted,
    }
    for what in (one for one, is_contradicted in found.items() if is_contradicted):
        once.warn(what, "contradicted", "not this integrator's, of another program or before a cut: its own is sent again")


def setup_of(rig: RecordedRig) -> IntegratorSetup:
    """Setup of the integrator from a rig, or from that recorded in a take.  Raises ValueError."""
    return integrator_setup(TEN_PARTS, rig.cameras(), rig.frame_ns(), rig.person_height, rig.added())


def run_integrator(
    rig: Rig, options: ZenohOptions, folder: Path, take: Path | None, stopped: Callable[[], bool], parameters: Parameters,
    *, must_log: bool = True,
) -> int:  # fmt: skip
    """Run until `stopped`.  Returns the exit status.

    folder: of takes that are started on request.  take: the one that begins at once; None: none does.
    parameters: of the rig's services, for the log.
    must_log: raise RecordingError when the take cannot be opened; otherwise log the error and track without a take.
    Raises BusError, RecordingError and ValueError before the first frame.
    """
    method = method_of(rig.method)
    if method.pose_service == "integrator":
        service = new_pose_service(method, rig)
    else:
        own = integrator_service(rig) if method.exchange else timekeeper_service(rig)
        service = cast("Service[object, object, Never]", own)
    with loading(stopped):
        service.load()
    clock, warn = RealClock(), partial(warn_of_others, OncePerSource(logging.getLogger(__name__)))

    def log(path: Path, *, must_open: bool) -> Log:
        parts = new_parts(rig, path, clock.now_ns(), parameters, clock.elapsed_ns, must_open=must_open)
        return Log(bus.reader(), parts, whole_rig=True, own=services_of(rig))

    with ZenohBus.open(options, rig.name, clock, stopped, services_of(rig)) as bus:
        bus.serve_service_info(service_info(rig, "integrator", ID, clock.now_ns()))
        first = None if take is None else log(take, must_open=must_log)
        logs = LogControl(bus.reader(), lambda: log(take_path(rig.name, folder, clock.now_ns()), must_open=True), first)
        logs.start()

        def closed() -> Mapping[str, int]:
            logs.close()
            return logs.counts()

        try:
            status = run(service, bus, clock, stopped=stopped, extra_counts=logs.counts, final_counts=closed, on_state=warn)
        finally:
            ends = logs.close()
    return status or (LOSS if any(end.incomplete for end in ends) else 0)
