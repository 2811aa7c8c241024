"""The viewer process: read the rig, open the bus and the source, run."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache, partial
from typing import TypeAlias, cast

from zenocap.common.arrays import Image
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import CameraInfo
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.services import services_of
from zenocap.common.rig.sources import Background, BackgroundImage
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.frame_rate import FrameChoice
from zenocap.common.runtime.service import Service, TopicSubscription, run
from zenocap.common.runtime.service_info import service_info
from zenocap.common.runtime.signals import loading
from zenocap.common.table import attribute
from zenocap.common.topics import FRAME_RATE, TRACKER_BDP, TRACKER_POSE
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.threads import use_one_thread
from zenocap.services.viewer.epoch import agreed_epoch
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.kept_background import BackgroundKeeper, kept_path, owner_of, read_kept
from zenocap.services.viewer.parameters import SMALL_TRACKED
from zenocap.services.viewer.people.network import load_network
from zenocap.services.viewer.people.segmenter import PeopleSegmenter
from zenocap.services.viewer.sources.device import Opener
from zenocap.services.viewer.sources.images import read_picture
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import fit_of
from zenocap.services.viewer.sources.source import longest_run_ns, open_source
from zenocap.services.viewer.sources.stamps import SourceRate
from zenocap.services.viewer.sources.tap import Filming, Tap
from zenocap.services.viewer.sources.video import median_picture
from zenocap.services.viewer.states import ViewerSetup
from zenocap.services.viewer.step import SilhouetteState, describe, initial_state, phase_of, step

Factory: TypeAlias = Callable[[Rig, Viewer, PeopleSegmenter | None, Adaptive | None], Service[object, object, Frame]]


def silhouettes(
    rig: Rig, viewer: Viewer, people: PeopleSegmenter | None, kept: Adaptive | None
) -> Service[ViewerSetup, SilhouetteState, Frame]:
    return silhouette_service(viewer, people, kept)


def silhouette_service(
    viewer: Viewer, people: PeopleSegmenter | None = None, kept: Adaptive | None = None
) -> Service[ViewerSetup, SilhouetteState, Frame]:
    """Service of one viewer of a rig with a tracker; publishes silhouettes only.

    people: the network that corrects the silhouettes, see `people_of`; None: without.
    kept: background of an earlier run, see `kept_background`; None: it is learnt.

    With feedback it receives the tracker's body and poses, which are inputs of its step and in its input trace.
    Raises SourceError for an unreadable background picture.
    """
    used = viewer.background_in_use
    plate = plate_of(viewer, used)
    setup = ViewerSetup(viewer.id, viewer.camera, used, viewer.preview, plate, people, kept, SMALL_TRACKED)
    fed = (TRACKER_BDP, TRACKER_POSE) if viewer.feedback else ()
    return Service(
        "viewer", viewer.id, setup, partial(initial_state, setup), step, tuple(map(TopicSubscription, (FRAME_RATE, *fed))),
        describe, phase=phase_of,
    )  # fmt: skip


def service_of(
    rig: Rig, viewer: Viewer, people: PeopleSegmenter | None = None, kept: Adaptive | None = None
) -> Service[object, object, Frame]:
    """Service of a viewer for the rig's method.  people, kept: see `silhouette_service`.  Raises as that does."""
    return cast("Factory", attribute(method_of(rig.method).viewer))(rig, viewer, people, kept)


def people_of(viewer: Viewer, *, threaded: bool) -> PeopleSegmenter | None:
    """The network of a viewer with `people = true`, None for others.  threaded: whether it runs beside the frames.

    Raises UserError when its model file is missing or another.
    """
    return PeopleSegmenter(load_network(), threaded=threaded) if viewer.people else None


def plate_of(viewer: Viewer, used: Background) -> Image | None:
    """Plate of an image background at the working size; None for other backgrounds.  used: background in use.

    Raises SourceError.
    """
    if not isinstance(used, BackgroundImage):
        return None
    fit = fit_of(viewer).named(used.path)
    if used is not viewer.background:  # the median of a video
        return median_picture(used.path, fit, hardware=used.hardware)
    return fit(read_picture(used.path))


def run_viewer(
    rig: Rig,
    id: str,
    options: ZenohOptions,
    stopped: Callable[[], bool],
    epoch_ns: int | None = None,
    filming: Filming | None = None,
    opener: Opener | None = None,
) -> int:
    """Run until `stopped` or the end of a file; returns the exit status.

    epoch_ns: see `Playback`; None: agreed with the other viewers.  filming: begins what films the images of a camera or
    stream; None: nothing does.  opener: of these; None: that of the table of sources.

    Raises UserError, BusError, SourceError and ValueError before the first frame.
    """
    use_one_thread()
    viewer = rig.viewer(id)
    with ExitStack() as stack:
        people = people_of(viewer, threaded=True)
        if people is not None:
            stack.callback(people.close)
        kept, keeper = None, None
        if viewer.keep_background:
            kept = read_kept(rig, viewer)
            keeper = BackgroundKeeper(kept_path(rig, viewer), owner_of(rig, viewer), kept is not None, time.monotonic)
        service = service_of(rig, viewer, people, kept)
        with loading(stopped):
            service.load()
        if keeper is not None:
            stack.callback(keeper.close)
        clock = RealClock()
        bus = stack.enter_context(ZenohBus.open(options, rig.name, clock, stopped, services_of(rig)))
        bus.serve_service_info(service_info(rig, "viewer", viewer.id, clock.now_ns()))
        if viewer.source.live:
            epoch_ns = clock.now_ns()
        elif epoch_ns is None:
            run_ns = {other.id: cache(partial(longest_run_ns, other)) for other in rig.viewers if other is not viewer}
            with bus.reader() as others:
                epoch_ns = agreed_epoch(run_ns, partial(camera_info, viewer), others, clock, stopped)
        choice = FrameChoice(rig.fps)
        rate = SourceRate() if viewer.source.live else None
        tap = Tap(viewer.calibrated_size, viewer.fps)
        frames = open_source(viewer, Playback(epoch_ns, clock, choice=choice), rate, tap, opener)
        if rate is not None and filming is not None:
            films = filming(tap, clock)
            stack.callback(films.close)
            bus.serve_films(viewer.id, films.answer, films.check, films.sender)
        return run(
            service, bus, clock, frames, stopped, first_messages=(camera_info(viewer, epoch_ns),), choice=choice,
            extra_counts=rate.counts if rate else dict,
            on_state=cast("Callable[[object], None]", keeper) if keeper else lambda _: None,
        )  # fmt: skip


def camera_info(viewer: Viewer, epoch_ns: int) -> CameraInfo:
    """Calibration of the camera at the working size; epoch_ns: capture time of frame 0."""
    camera = viewer.camera
    return CameraInfo(
        frame=0, captured_ns=epoch_ns, viewer=viewer.id, name=camera.name, size=camera.size,
        matrix=camera.matrix.ravel().tolist(), distortions=camera.distortions.ravel().tolist(),
        rotation=camera.rotation.ravel().tolist(), translation=camera.translation.ravel().tolist(),
    )  # fmt: skip
