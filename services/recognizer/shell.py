"""The recogniser as a process: rigs in, a bus for each, one model for all that name it, run."""

import hashlib
import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Never

from common.body.anatomy import ANATOMIES, TEN_PARTS, Anatomy
from common.bus.protocol import BusError
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Message, Posture
from common.runtime.about import about
from common.runtime.clock import RealClock
from common.runtime.rig import Rig, RigError
from common.runtime.service import Event, Service, Subscription, run
from common.take.reading import TakeError
from common.take.setup import POSTURES_FILE, RecordedRig, recorded_rig
from common.topics import TRACKER_POSE, UNIVERSAL_BAP, Topic
from services.recognizer.file import PostureModelError, parse_model, read_model
from services.recognizer.model import PostureModel
from services.recognizer.ready import load_compiled
from services.recognizer.states import Setup, Source, State
from services.recognizer.step import counts, describe, initial_state, step
from services.recognizer.stream import plan_of

logger = logging.getLogger(__name__)

ID = "main"
FAILED = 1
SOURCES: dict[Source, Topic] = {"integrator": UNIVERSAL_BAP, "tracker": TRACKER_POSE}
MOST_LABELS = 256  # what a message can say the likelihoods of


def recognizer_service(rig: Rig, model: PostureModel) -> Service[Setup, State, Never]:
    """The recogniser of a rig.  Raises ValueError for a rig without one."""
    setup = setup_of(recorded_rig(rig), model)
    topics = (Subscription(SOURCES[setup.source]),)
    return Service("recognizer", ID, setup, initial_state(setup), step, topics, describe, counts, result=Posture)


def setup_of(rig: RecordedRig, model: PostureModel) -> Setup:
    """The recogniser's setup, of a rig or of what a take says of one.  Raises ValueError."""
    if rig.recognizer is None:
        raise ValueError(f"rig {rig.name} has no recognizer")
    source = rig.recognizer.source
    return Setup(plan_of(model, rig.recognizer.strictness), source, _anatomy(rig) if source == "tracker" else TEN_PARTS)


def model_of(rig: Rig) -> PostureModel:
    """The model that a rig names.  Raises RigError and PostureModelError."""
    if rig.recognizer is None:
        raise RigError(f"rig {rig.name}: allowed for a recogniser: a [recognizer] table")
    path = rig.recognizer.model
    try:
        return checked(path, read_model(path))
    except OSError as error:
        raise PostureModelError(f"{path}: cannot be read: {error.strerror}") from error


def model_in(rig: RecordedRig, path: Path, attached: bytes | None) -> PostureModel | None:
    """The model that a take was made with; None where it is not in there.  path: of the take.

    Raises TakeError when the attachment is missing, PostureModelError and ValueError when it is not the one it says.
    """
    digest = rig.recognizer.model_sha256 if rig.recognizer else None
    if digest is None:
        return None
    if attached is None:
        raise TakeError(
            f"{path}: attachment {POSTURES_FILE} is missing: the model that the take was made with is not known"
        )
    found = hashlib.sha256(attached).hexdigest()
    if found != digest:
        raise ValueError(
            f"{path}: attachment {POSTURES_FILE}: sha256 = {found[:12]}...: allowed: {digest[:12]}..., as made with"
        )
    return checked(path / POSTURES_FILE, parse_model(path / POSTURES_FILE, attached))


def checked(path: Path, model: PostureModel) -> PostureModel:
    """Raises PostureModelError for a model with more postures than a message can hold."""
    if len(model.labels) > MOST_LABELS:
        raise PostureModelError(f"{path}: {len(model.labels)} postures: allowed on the network: {MOST_LABELS}")
    return model


def run_recognizers(rigs: Sequence[tuple[Rig, ZenohOptions]], stopped: Callable[[], bool]) -> int:
    """Run one recogniser for each rig until `stopped`; returns the exit status, 1 when one of them failed.

    A rig that fails is told, and the others go on.  Raises RigError, PostureModelError and ValueError before any runs.
    """
    names = [rig.name for rig, _ in rigs]
    if len(set(names)) < len(names):
        raise RigError(f"rigs {', '.join(names)}: allowed: rigs of different names")
    models: dict[Path, PostureModel] = {}
    services: list[Service[Setup, State, Never]] = []
    for rig, _ in rigs:
        if rig.recognizer is not None and rig.recognizer.model not in models:
            models[rig.recognizer.model] = model_of(rig)
        model = models[rig.recognizer.model] if rig.recognizer is not None else model_of(rig)
        services.append(recognizer_service(rig, model))
    for service in services:
        load_compiled(service.setup.plan, service.setup.anatomy)
    statuses = [FAILED] * len(rigs)

    def run_one(place: int) -> None:
        rig, options = rigs[place]
        try:
            statuses[place] = _run(rig, options, services[place], stopped)
        except BusError as error:
            logger.error("rig %s: %s", rig.name, error)
        except Exception:  # of one rig; the others have nothing to do with it
            logger.exception("rig %s failed", rig.name)
        if statuses[place] and len(rigs) > 1:
            logger.error("rig %s: its recogniser has ended; the others go on", rig.name)

    threads = [threading.Thread(target=run_one, args=(place,), name=name) for place, name in enumerate(names)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return max(statuses)


def _run(rig: Rig, options: ZenohOptions, service: Service[Setup, State, Never], stopped: Callable[[], bool]) -> int:
    clock = RealClock()
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        bus.introduce(about(rig, "recognizer", ID, clock.now_ns()))
        return run(_telling(rig.name, service), bus, clock, stopped=stopped)


def _telling(name: str, service: Service[Setup, State, Never]) -> Service[Setup, State, Never]:
    """The service, which logs every posture as it is said."""

    def stepped(setup: Setup, state: State, event: Event[Never]) -> tuple[State, Sequence[Message]]:
        state, messages = step(setup, state, event)
        for message in messages:
            if isinstance(message, Posture):
                logger.info("%s: %s", name, in_words(message))
        return state, messages

    return replace(service, step=stepped)


def in_words(posture: Posture) -> str:
    lasted_s = (posture.end_ns - posture.start_ns) / 1e9
    return f"{posture.label or 'none of its postures'}, {lasted_s:.1f} s, margin {posture.margin:.2f}"


def _anatomy(rig: RecordedRig) -> Anatomy:
    name = rig.tracker.anatomy if rig.tracker else ""
    if name not in ANATOMIES:
        raise ValueError(f"tracker.anatomy = {name!r}: allowed: {', '.join(ANATOMIES)}")
    return ANATOMIES[name]
