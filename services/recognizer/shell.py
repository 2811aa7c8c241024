"""Process of the recognizer: one service per rig, equal models shared."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Never

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError, reading
from zenocap.common.messages import Message, Posture
from zenocap.common.recording.setup_file import POSTURES_FILE, RecordedRig, checked_attachment, recorded_rig
from zenocap.common.rig.commands import PostureCommand, check_postures, check_programs
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.rig.table_errors import TableError
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.compiled import compiling
from zenocap.common.runtime.service import Event, Service, TopicSubscription, run
from zenocap.common.runtime.service_info import service_info
from zenocap.common.runtime.signals import WAIT_S, loading
from zenocap.common.topics import TRACKER_POSE, UNIVERSAL_BAP, Topic
from zenocap.services.recognizer.command_runner import CommandRunner
from zenocap.services.recognizer.jit_warmup import load_compiled
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import parse_model, read_model
from zenocap.services.recognizer.step import (
    RecognizerSetup,
    RecognizerState,
    Source,
    counts,
    describe,
    initial_state,
    phase_of,
    step,
)
from zenocap.services.recognizer.stream import stream_setup

logger = logging.getLogger(__name__)

ID = "main"
FAILED = 1
SOURCES: dict[Source, Topic] = {"integrator": UNIVERSAL_BAP, "tracker": TRACKER_POSE}


def recognizer_service(rig: Rig, model: PostureModel) -> Service[RecognizerSetup, RecognizerState, Never]:
    """Recognizer service of a rig.  Raises ValueError for a rig without one."""
    return service_of(setup_of(recorded_rig(rig), model))


def service_of(setup: RecognizerSetup) -> Service[RecognizerSetup, RecognizerState, Never]:
    topics = (TopicSubscription(SOURCES[setup.source]),)
    initial = partial(initial_state, setup)
    return Service("recognizer", ID, setup, initial, step, topics, describe, counts, phase_of, result=Posture)


def setup_of(rig: RecordedRig, model: PostureModel) -> RecognizerSetup:
    """Setup of the recognizer of a rig or of a take's rig.  Raises ValueError for a rig without one."""
    if rig.recognizer is None:
        raise ValueError(f"rig {rig.name} has no recognizer")
    source = rig.recognizer.source
    stream = stream_setup(model, rig.recognizer.strictness)
    return RecognizerSetup(stream, source, rig.anatomy() if source == "tracker" else TEN_PARTS)


def setup_for_poses(rig: Rig, model: PostureModel) -> RecognizerSetup:
    """Setup that recognizes the poses of a rig with a model; it needs no recognizer.  Raises ValueError."""
    recorded = recorded_rig(rig)
    if recorded.recognizer is not None:
        return setup_of(recorded, model)
    source: Source = method_of(recorded.method).pose_service
    return RecognizerSetup(stream_setup(model), source, TEN_PARTS if recorded.tracker is None else recorded.anatomy())


def model_of(rig: Rig) -> PostureModel:
    """Read the model given in a rig file.  Raises UserError."""
    if rig.recognizer is None:
        raise UserError(f"rig {rig.name}: allowed for a recognizer: a [recognizer] table")
    path = rig.recognizer.model
    with reading(path):
        return read_model(path)


def model_in(rig: RecordedRig, path: Path, attached: bytes | None) -> PostureModel | None:
    """Model with which a take was recorded; None where the take does not contain it.  path: of the take.

    Raises UserError when the attachment is missing or cannot be read, ValueError when its digest differs.
    """
    digest = rig.recognizer.model_sha256 if rig.recognizer else None
    content = checked_attachment(path, POSTURES_FILE, attached, digest)
    return None if content is None else parse_model(path / POSTURES_FILE, content)


def run_recognizers(rigs: Sequence[tuple[Rig, ZenohOptions]], stopped: Callable[[], bool]) -> int:
    """Run one recognizer per rig until `stopped`; returns the exit status, 1 when any of them failed.

    A failing rig is logged and does not stop the others.  Raises UserError and ValueError before the first one starts.
    """
    names = [rig.name for rig, _ in rigs]
    if len(set(names)) < len(names):
        raise UserError(f"rigs {', '.join(names)}: allowed: rigs of different names")
    models: dict[Path | None, PostureModel] = {}
    services: list[Service[RecognizerSetup, RecognizerState, Never]] = []
    for rig, _ in rigs:
        path = None if rig.recognizer is None else rig.recognizer.model
        model = models[path] = models.get(path) or model_of(rig)
        check_commands(rig, model)
        services.append(recognizer_service(rig, model))
    with loading(stopped), compiling(logger, "recognizer-service", "recognizer"):
        for service in services:
            load_compiled(service.setup.stream, service.setup.anatomy)
    statuses = [FAILED] * len(rigs)

    def run_one(index: int) -> None:
        rig, options = rigs[index]
        try:
            statuses[index] = _run(rig, options, services[index], stopped)
        except BusError as error:
            logger.error("rig %s: %s", rig.name, error)
            statuses[index] = 0 if stopped() else FAILED
        except Exception:  # a bug in one rig must not end the others
            logger.exception("rig %s failed", rig.name)
        if statuses[index] and len(rigs) > 1:
            logger.error("rig %s: its recognizer has stopped; the others continue", rig.name)

    threads = [threading.Thread(target=run_one, args=(index,), name=name) for index, name in enumerate(names)]
    for thread in threads:
        thread.start()
    for thread in threads:
        while thread.is_alive():
            thread.join(WAIT_S)
    return max(statuses)


def check_commands(rig: Rig, model: PostureModel) -> None:
    """Raise UserError for a command of a posture that the model does not have, or of a program that is missing here."""
    if rig.recognizer is None:
        return
    try:
        check_postures(rig.recognizer.commands, model.labels, rig.recognizer.model.name)
        check_programs(rig.recognizer.commands)
    except TableError as error:
        raise UserError(f"{rig.files[0] if rig.files else rig.name}: recognizer.{error}") from error


def _run(
    rig: Rig, options: ZenohOptions, service: Service[RecognizerSetup, RecognizerState, Never], stopped: Callable[[], bool]
) -> int:
    clock = RealClock()
    commands: Sequence[PostureCommand] = rig.recognizer.commands if rig.recognizer is not None else ()
    with ZenohBus.open(options, rig.name, clock, stopped, services_of(rig)) as bus:
        bus.serve_service_info(service_info(rig, "recognizer", ID, clock.now_ns()))
        runner = CommandRunner(rig.name, commands, bus.put, bus.wake, clock)
        try:
            return run(
                _observed(rig.name, service, runner.receive), bus, clock, stopped=stopped, extra_counts=runner.counts,
                requested=runner.results, on_clock_offset=runner.set_clock_offset,
            )  # fmt: skip
        finally:
            runner.close()


def _observed(
    name: str, service: Service[RecognizerSetup, RecognizerState, Never], on_posture: Callable[[Posture], None]
) -> Service[RecognizerSetup, RecognizerState, Never]:
    """The service with a log line for every posture that it publishes, which is passed to `on_posture`.

    Commands are triggered here and not in the step: recomputing or tracking a take performs none.
    """

    def observed_step(
        setup: RecognizerSetup, state: RecognizerState, event: Event[Never]
    ) -> tuple[RecognizerState, Sequence[Message]]:
        state, messages = step(setup, state, event)
        for message in messages:
            if isinstance(message, Posture):
                on_posture(message)
                duration_s = (message.end_ns - message.start_ns) / 1e9
                label = message.label or "unknown movement"
                logger.info("%s: %s, %.1f s, margin %.2f", name, label, duration_s, message.margin)
        return state, messages

    return replace(service, step=observed_step)
