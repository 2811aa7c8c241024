"""A viewer as a process: rig in, bus open, source open, run."""

import logging
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np

from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.camera.pinhole import Camera
from common.messages import CameraInfo
from common.runtime.about import about
from common.runtime.clock import RealClock
from common.runtime.rig import Rig, Viewer
from common.runtime.service import Service, Subscription, run
from common.runtime.specs import BackgroundImage, Device, Stream
from common.topics import ASSIGNMENT, UNIVERSAL_BAP, UNIVERSAL_BDP
from services.viewer import watching
from services.viewer.beginning import agreed_epoch
from services.viewer.ready import load_compiled
from services.viewer.source import open_source
from services.viewer.sources.fit import Fit
from services.viewer.sources.frame import Frame, Image, OpenError, Playback
from services.viewer.sources.video import median_picture
from services.viewer.states import Setup, State, viewer_setup
from services.viewer.step import describe, initial_state, step

logger = logging.getLogger(__name__)

S = TypeVar("S")


def viewer_service(viewer: Viewer) -> Service[Setup, State, Frame]:
    """One viewer of a two-view rig.

    Raises OpenError for an unreadable background picture, ValueError for a useless camera.
    """
    setup = _setup(viewer)
    topics = (ASSIGNMENT, UNIVERSAL_BDP, UNIVERSAL_BAP)
    return Service("viewer", viewer.id, setup, initial_state(setup), step, tuple(map(Subscription, topics)), describe)


def silhouette_service(viewer: Viewer) -> Service[Setup, watching.State, Frame]:
    """One viewer of a rig with a tracker, which asks it for silhouettes alone.  Raises as `viewer_service` does."""
    setup = _setup(viewer)
    return Service("viewer", viewer.id, setup, watching.initial_state(setup), watching.step, describe=watching.describe)


def _setup(viewer: Viewer) -> Setup:
    background, plate = viewer.background_in_use, None
    match viewer.background, background:
        case BackgroundImage(path=path), _:
            plate = _picture(viewer, path)
        case _, BackgroundImage(path=path):
            plate = median_picture(path, Fit(str(path), viewer.calibrated_size, viewer.camera.size))
        case _:
            pass
    return viewer_setup(viewer.id, viewer.camera, background, viewer.silhouette, viewer.preview, plate)


def run_viewer(rig: Rig, id: str, options: ZenohOptions, stopped: Callable[[], bool], epoch_ns: int | None = None) -> int:
    """Run until `stopped` or the end of a file; epoch_ns: see `Playback`, agreed with the other viewers if None.

    Returns the exit status.  Raises RigError, BusError, SourceError and ValueError before it runs.
    """
    viewer = rig.viewer(id)
    if rig.tracker is not None:
        return _run(silhouette_service(viewer), rig, viewer, options, stopped, epoch_ns)
    service = viewer_service(viewer)
    logger.info("getting ready; the first time ever compiles for some 20 s")
    load_compiled(service.setup)
    return _run(service, rig, viewer, options, stopped, epoch_ns)


def _run(
    service: Service[Setup, S, Frame],
    rig: Rig,
    viewer: Viewer,
    options: ZenohOptions,
    stopped: Callable[[], bool],
    epoch_ns: int | None,
) -> int:
    clock = RealClock()
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        bus.introduce(about(rig, "viewer", viewer.id, clock.now_ns()))
        if isinstance(viewer.source, Device | Stream):
            epoch_ns = clock.now_ns()
        elif epoch_ns is None:
            with bus.reader() as others:
                ids = [other.id for other in rig.viewers if other is not viewer]
                epoch_ns = agreed_epoch(ids, partial(camera_info, viewer), others, clock, stopped)
        greeting = (camera_info(viewer, epoch_ns),)
        frames: Iterator[Frame] = open_source(viewer, Playback(epoch_ns, clock))
        return run(service, bus, clock, frames, stopped, greeting=greeting)


def camera_info(viewer: Viewer, epoch_ns: int) -> CameraInfo:
    """The calibration of a viewer's camera at the working size; epoch_ns: capture time of frame 0."""
    camera: Camera = viewer.camera
    return CameraInfo(
        frame=0,
        captured_ns=epoch_ns,
        viewer=viewer.id,
        name=camera.name,
        size=camera.size,
        matrix=camera.matrix.ravel().tolist(),
        distortions=camera.distortions.ravel().tolist(),
        rotation=camera.rotation.ravel().tolist(),
        translation=camera.translation.ravel().tolist(),
    )


def _picture(viewer: Viewer, path: Path) -> Image:
    """A background picture at the viewer's working size.  Raises OpenError and SizeMismatch."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise OpenError(f"{path}: not a picture that can be decoded")
    return Fit(str(path), viewer.calibrated_size, viewer.camera.size)(np.asarray(image, dtype=np.uint8))
