"""The source of one viewer, whatever it is."""

from collections.abc import Iterator

from common.runtime.rig import Viewer
from common.runtime.specs import Actor, Device, FirstFrames, Images, Rendered, Stream, VideoFile
from services.viewer.sources.device import camera_frames
from services.viewer.sources.frame import Frame, Playback
from services.viewer.sources.images import image_frames
from services.viewer.sources.rendered import rendered_frames
from services.viewer.sources.video import declared_frames, video_frames

PREROLL = 30  # frames of empty scene from the actor when the background does not say how many it needs


def open_source(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    """The viewer's frames at its working size, at its rate.

    Raises SourceError, on the first frame or later: OpenError, AccessDenied, SizeMismatch, EndedEarly.
    """
    size, fps = viewer.camera.size, viewer.fps
    preroll = viewer.background.count if isinstance(viewer.background, FirstFrames) else 0
    match viewer.source:
        case Device() | Stream():
            return camera_frames(viewer.source, fps, viewer.calibrated_size, size, playback)
        case VideoFile():
            return video_frames(viewer.source, fps, viewer.calibrated_size, size, playback, preroll)
        case Images():
            return image_frames(viewer.source, fps, viewer.calibrated_size, size, playback)
        case Rendered():
            return rendered_frames(viewer.source, fps, viewer.calibrated_size, size, playback)
        case Actor():
            from services.viewer.sources.actor import actor_frames  # compiles the renderer: only where it is used

            return actor_frames(viewer.source, fps, viewer.camera, playback, preroll or PREROLL)


def frame_count(viewer: Viewer) -> int | None:
    """About how many frames a source that ends will give; None when it does not end or cannot be told."""
    match viewer.source:
        case VideoFile(path=path, initial=initial):
            return sum(declared_frames(file, viewer.fps) for file in (path, initial) if file is not None)
        case Images(folder=folder, pattern=pattern):
            return sum(1 for _ in folder.glob(pattern))
        case _:
            return None
