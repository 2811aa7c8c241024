"""The source of one viewer, whatever it is."""

from collections.abc import Iterator

from common.runtime.rig import Viewer
from common.runtime.specs import Actor, Device, FirstFrames, Images, Stream, VideoFile
from services.viewer.sources.device import camera_frames
from services.viewer.sources.frame import Frame, Playback
from services.viewer.sources.images import image_frames
from services.viewer.sources.video import video_frames

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
        case Actor():
            from services.viewer.sources.actor import actor_frames  # compiles the renderer: only where it is used

            return actor_frames(viewer.source, fps, viewer.camera, playback, preroll or PREROLL)
