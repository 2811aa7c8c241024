"""Services of a rig without a network: for a session, or to run again on the messages of a take."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Never, TypeAlias, cast

from zenocap.common.messages import CameraInfo
from zenocap.common.recording.setup_file import POSTURES_FILE, PRIOR_FILE, RecordedRig, RecordedViewer
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import MAIN, ServiceKey, kinds_of
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.rig.two_view import Additions
from zenocap.common.runtime.service import Service, Stepper, new_pose_service
from zenocap.services.integrator import shell as integrator_shell
from zenocap.services.recognizer import shell as recognizer_shell
from zenocap.services.recognizer.step import RecognizerSetup, RecognizerState
from zenocap.services.tracker import shell as tracker_shell
from zenocap.services.tracker.states import TrackerSetup
from zenocap.services.viewer.frame import Frame, SegmentedFrame
from zenocap.services.viewer.shell import camera_info, people_of, service_of
from zenocap.services.viewer.two_view import step as viewer
from zenocap.services.viewer.two_view.states import TwoViewSetup, TwoViewState

Stepped: TypeAlias = Stepper[object, object, SegmentedFrame]


def members(rig: Rig) -> list[Service[object, object, Frame]]:
    """Services of a session: of the poses, an integrator beside it, the viewers in the rig's order, the recognizer if any.

    Raises as the services of the rig's method, `people_of` and `model_of` do.
    """
    method = method_of(rig.method)
    services: list[object] = [new_pose_service(method, rig)]
    if method.exchange and method.has_tracker:
        services.append(integrator_shell.integrator_service(rig))
    services += [service_of(rig, viewer, people_of(viewer, threaded=False)) for viewer in rig.viewers]
    if rig.recognizer is not None:
        services.append(recognizer_shell.recognizer_service(rig, recognizer_shell.model_of(rig)))
    return cast("list[Service[object, object, Frame]]", services)


def cameras(rig: Rig, epoch_ns: int) -> list[CameraInfo]:
    """The camera of every viewer.  epoch_ns: capture time of frame 0."""
    return [camera_info(viewer, epoch_ns) for viewer in rig.viewers]


def tracker_setup(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> TrackerSetup:
    """Setup of a take's tracker.  path: of the take, for errors.  attached: its attachments.

    Raises ValueError for cameras that the method cannot use or another prior than the recorded one, UserError without it.
    """
    return tracker_shell.setup_of(rig, tracker_shell.prior_in(rig, path, attached.get(PRIOR_FILE)))


def recorded_recognizer(
    rig: RecordedRig, path: Path, attached: Mapping[str, bytes]
) -> Service[RecognizerSetup, RecognizerState, Never] | None:
    """The recognizer of a take; None where its model was missing when the take was recorded.  Raises as `tracker_setup`."""
    model = recognizer_shell.model_in(rig, path, attached.get(POSTURES_FILE))
    return None if model is None else recognizer_shell.service_of(recognizer_shell.setup_of(rig, model))


def steppers(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[ServiceKey, Stepped]:
    """Services that publish derived messages, to process their recorded inputs.  Raises as `tracker_setup`."""
    build: Mapping[str, Callable[[], Mapping[str, object]]] = {  # by name in the table of services; by id
        "viewer": lambda: {viewer.id: _viewer(viewer, rig.added()) for viewer in rig.viewers},
        "integrator": lambda: {MAIN: _integrator(rig)},
        "tracker": lambda: {MAIN: tracker_shell.service_of(tracker_setup(rig, path, attached))},
        "recognizer": lambda: {MAIN: one} if (one := recorded_recognizer(rig, path, attached)) else {},
    }
    kinds = [kind for kind in kinds_of(rig) if kind.recomputed(rig)]
    built = {(kind.name, id): service for kind in kinds for id, service in build[kind.name]().items()}
    return {key: Stepper(cast("Service[object, object, SegmentedFrame]", service)) for key, service in built.items()}


def _integrator(rig: RecordedRig) -> object:
    if method_of(rig.method).only_silhouettes:  # clock, log, frame rate, delays
        return integrator_shell.timekeeper_of(rig)
    return integrator_shell.service_of(integrator_shell.setup_of(rig))


def _viewer(recorded: RecordedViewer, additions: Additions) -> Service[TwoViewSetup, TwoViewState, SegmentedFrame]:
    # Only the number of learning frames matters: silhouettes come from the take.
    background = FirstFrames(recorded.learning_frames)
    setup = TwoViewSetup(recorded.id, recorded.pinhole(), background, additions=additions)
    return Service("viewer", recorded.id, setup, partial(viewer.initial_state, setup), viewer.step)
