"""The integrator as a process: rig in, bus open, log open, run."""

from collections.abc import Callable
from pathlib import Path
from typing import Never, TypeVar

from common.body.anatomy import TEN_PARTS
from common.body.limbs import limb_angles, limb_directions
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Message, UniversalBap
from common.runtime.about import about
from common.runtime.clock import RealClock
from common.runtime.rig import Rig
from common.runtime.service import Event, Service, Subscription, run
from common.take.log import Log
from common.take.naming import take_path
from common.take.opening import new_parts
from common.take.setup import RecordedRig, recorded_rig
from common.topics import HEALTH, PARTIAL_BAP, PARTIAL_BDP, REQUEST, SIGHTING, UNIVERSAL_BAP, UNIVERSAL_BDP
from services.integrator.states import Setup, State, integrator_setup
from services.integrator.step import counts, describe, initial_state, knows_nobody, step
from services.integrator.switch import Switch

ID = "main"
S = TypeVar("S")
T = TypeVar("T")
LOSS = 3  # exit status: all went well, but the log is not complete


def integrator_service(rig: Rig) -> Service[Setup, State, Never]:
    """The integrator of a rig.  Raises ValueError when its cameras do not suit the method."""
    setup = setup_of(recorded_rig(rig))
    topics = (SIGHTING, PARTIAL_BDP, PARTIAL_BAP, REQUEST)
    return Service(
        "integrator",
        ID,
        setup,
        initial_state(setup),
        step,
        (*(Subscription(topic) for topic in topics), Subscription(HEALTH, names={"service": "viewer"})),
        describe,
        counts,
        result=UniversalBap,
        recalls=lambda state: (UNIVERSAL_BDP, UNIVERSAL_BAP) if knows_nobody(state) else (),
        keeps_time=True,
    )


def timekeeper_service(rig: Rig) -> Service[None, None, Never]:
    """The integrator where the tracker does its work: it keeps the clock, and in its process the log."""
    words = f"method {rig.method}: keeps clock and log, the tracker finds the pose"
    return Service("integrator", ID, None, None, _nothing, describe=lambda _: words, keeps_time=True)


def _nothing(_: None, state: None, event: Event[Never]) -> tuple[None, list[Message]]:
    return state, []


def setup_of(rig: RecordedRig) -> Setup:
    """The integrator's setup, of a rig or of what a take says of one.  Raises ValueError."""
    return integrator_setup(TEN_PARTS, rig.cameras(), rig.frame_ns(), rig.person_height)


def run_integrator(
    rig: Rig, options: ZenohOptions, take: Path | None, stopped: Callable[[], bool], *, must_log: bool = True
) -> int:
    """Run until `stopped`; take: where the log is written, None for no log.  Returns the exit status.

    must_log: raise RecordingError when the take cannot be opened; else that is said, and the rig tracks without it.
    Raises BusError, RecordingError and ValueError before it runs.
    """
    if rig.tracker is not None:
        return _run(timekeeper_service(rig), rig, options, take, stopped, must_log)
    service = integrator_service(rig)
    limb_angles(TEN_PARTS, limb_directions(TEN_PARTS, TEN_PARTS.neutral), TEN_PARTS.neutral)  # loads what is compiled
    return _run(service, rig, options, take, stopped, must_log)


def _run(
    service: Service[S, T, Never],
    rig: Rig,
    options: ZenohOptions,
    take: Path | None,
    stopped: Callable[[], bool],
    must_log: bool,
) -> int:
    clock = RealClock()
    folder = _folder(rig) if take is None else take.parent

    def log(path: Path, *, must_open: bool) -> Log:
        return Log(bus.reader(), new_parts(rig, path, clock.now_ns(), must_open=must_open))

    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        bus.introduce(about(rig, "integrator", ID, clock.now_ns()))
        first = None if take is None else log(take, must_open=must_log)
        switch = Switch(bus.reader(), lambda: log(take_path(rig.name, folder, clock.now_ns()), must_open=True), first)
        switch.start()
        try:
            status = run(service, bus, clock, stopped=stopped, extra_counts=switch.counts)
        finally:
            ends = switch.close()
    return status or (LOSS if any(end.lost or end.failure for end in ends) else 0)


def _folder(rig: Rig) -> Path:
    """Where takes go that are asked for while the rig runs."""
    return rig.base / rig.log.folder
