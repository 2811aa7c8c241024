"""The simulated person as a source: all viewers render the same motion, whenever they start."""

from collections.abc import Iterator

from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import OpenError
from zenocap.common.rig.sources import Actor, empty_frames
from zenocap.common.rig.viewers import Viewer
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import ACTOR_PREROLL
from zenocap.services.viewer.sources.playback import Playback
from zenocap.simulation.motion import timeline
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.simulation.rendering.camera import SimulatedCamera


def performance(source: Actor) -> MotionTimeline:
    """Motion of a source such as `actor:demo`, `actor:walking`, or a posture.  Raises OpenError."""
    try:
        return timeline.performance(source.name, source.seed)
    except (ValueError, KeyError) as error:
        allowed = "demo, walking, turning, running, boxing or a posture"
        raise OpenError(f"actor:{source.name}: allowed: {allowed}: {error}") from error


def frames_of(viewer: Viewer, playback: Playback) -> Iterator[Frame]:
    assert isinstance(viewer.source, Actor)
    preroll = empty_frames(viewer.background) or ACTOR_PREROLL
    return actor_frames(viewer.source, viewer.fps, viewer.camera, playback, preroll)


def actor_frames(source: Actor, fps: float, camera: Camera, playback: Playback, preroll: int) -> Iterator[Frame]:
    """Yield frame n with the time `epoch_ns` + n / fps, rendered for `camera` (at the working size).  Raises OpenError.

    Live, the source does not end, and late frames are dropped.  The first `preroll` frames show the empty scene even if the
    motion has begun, for the background model.  Otherwise every frame of the motion is yielded once.
    """
    script = performance(source)
    film = SimulatedCamera(camera, script.person, source.seed)
    if not playback.live:
        yield from filmed(script, film, fps, playback)
        return
    film.render(script.pose_at(script.motion_from_s), 0)  # compile before the first frame is due
    index, rendered = 0, 0
    while True:
        index = playback.next_index(index, fps)
        playback.wait_until(playback.time_of(index, fps))
        pose = script.pose_at(index / fps) if rendered >= preroll else None
        yield Frame(index, playback.time_of(index, fps), film.render(pose, index))
        index, rendered = index + 1, rendered + 1


def filmed(script: MotionTimeline, film: SimulatedCamera, fps: float, playback: Playback) -> Iterator[Frame]:
    """Yield every frame of the motion once."""
    for index in range(int(script.duration_s * fps)):
        yield Frame(index, playback.time_of(index, fps), film.render(script.pose_at(index / fps), index))
