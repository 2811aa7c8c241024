"""The services of a take's rig, set up to process their recorded inputs again."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TypeAlias, TypeVar, cast

from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.recording.setup_file import POSTURES_FILE, PRIOR_FILE, RecordedRig, RecordedViewer
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.services import MAIN, ServiceKey, kinds_of
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.rig.two_view import Additions
from zenocap.common.runtime.service import Service, Stepper
from zenocap.services.integrator import shell as integrator_shell
from zenocap.services.recognizer import shell as recognizer_shell
from zenocap.services.tracker import shell as tracker_shell
from zenocap.services.viewer import step as viewer
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.services.viewer.states import LearningBackground
from zenocap.services.viewer.states import Setup as ViewerSetup
from zenocap.services.viewer.states import State as ViewerState

Event = SegmentedFrame | Envelope | Alive | Tick
Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)
Recomputed: TypeAlias = Stepper[object, object, SegmentedFrame]


def services_of(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[ServiceKey, Recomputed]:
    """Services that publish derived messages, by name.  path: of the take, for errors.  attached: its attachments.

    Raises ValueError for cameras that the method cannot use, or another prior or model than the recorded one.
    """
    return {
        (kind.name, id): service
        for kind in kinds_of(rig)
        if kind.recomputed(rig)
        for id, service in BUILD[kind.name](rig, path, attached).items()
    }


def _stepper(service: Service[Setup, State, F]) -> Recomputed:
    return cast("Recomputed", Stepper(service))


def is_learning(service: Recomputed) -> bool:
    """Whether the background is being learnt: frames have no silhouette yet."""
    return isinstance(service.state, LearningBackground)


def _viewers(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> Mapping[str, Recomputed]:
    return {recorded.id: _viewer(recorded, rig.added()) for recorded in rig.viewers}


def _integrator(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> Mapping[str, Recomputed]:
    if method_of(rig.method).pose_service != "integrator":  # clock, log, frame rate, delays
        return {MAIN: _stepper(integrator_shell.timekeeper_of(rig))}
    return {MAIN: _stepper(integrator_shell.service_of(integrator_shell.setup_of(rig)))}


def _tracker(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> Mapping[str, Recomputed]:
    prior = tracker_shell.prior_in(rig, path, attached.get(PRIOR_FILE))
    return {MAIN: _stepper(tracker_shell.service_of(tracker_shell.setup_of(rig, prior)))}


def _recognizer(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> Mapping[str, Recomputed]:
    """Empty where the model of the rig was missing when the take was recorded."""
    model = recognizer_shell.model_in(rig, path, attached.get(POSTURES_FILE))
    if model is None:
        return {}
    return {MAIN: _stepper(recognizer_shell.service_of(recognizer_shell.setup_of(rig, model)))}


def _viewer(recorded: RecordedViewer, additions: Additions) -> Recomputed:
    # Only the number of learning frames matters: silhouettes come from the take.
    background = FirstFrames(recorded.learning_frames)
    setup = viewer.viewer_setup(recorded.id, recorded.pinhole(), background, publish_silhouette=False, additions=additions)
    service: Service[ViewerSetup, ViewerState, SegmentedFrame] = Service(
        "viewer", recorded.id, setup, partial(viewer.initial_state, setup), viewer.step
    )
    return _stepper(service)


# By name in the table of services; ids within.
BUILD: Mapping[str, Callable[[RecordedRig, Path, Mapping[str, bytes]], Mapping[str, Recomputed]]] = {
    "viewer": _viewers, "integrator": _integrator, "tracker": _tracker, "recognizer": _recognizer,
}  # fmt: skip
