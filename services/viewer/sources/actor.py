"""The synthetic actor as a camera: every viewer, whenever it starts, films the same performance."""

from collections.abc import Iterator

from common.actor.person import person
from common.actor.render import ActorCamera
from common.actor.script import Script, demo_script, motion_script
from common.camera.pinhole import Camera
from common.runtime.specs import Actor
from services.viewer.sources.frame import Frame, OpenError, Playback

DEMO = "demo"


def performance(source: Actor) -> Script:
    """The time line of `actor:demo`, or of walking, turning, running, boxing or a posture.  Raises OpenError."""
    somebody = person(source.seed)
    if source.name == DEMO:
        return demo_script(somebody, source.seed)
    try:
        return motion_script(somebody, source.name, source.seed)
    except (ValueError, KeyError) as error:
        allowed = "demo, walking, turning, running, boxing or a posture"
        raise OpenError(f"actor:{source.name}: allowed: {allowed}: {error}") from error


def actor_frames(source: Actor, fps: float, camera: Camera, playback: Playback, preroll: int) -> Iterator[Frame]:
    """Frame n at `epoch_ns` + n / fps, as `camera` (at the working size) sees it.  Raises OpenError.

    Live, it goes on for ever; frames that are late are left out.  A viewer's first `preroll` frames show the empty
    scene even if the performance has begun, so that it can learn its background.  Otherwise every frame of the script,
    once.
    """
    script = performance(source)
    film = ActorCamera(camera, script.person, source.seed)
    if not playback.live:
        yield from filmed(script, film, fps, playback)
        return
    film.render(script.pose_at(script.motion_from_s), 0)  # what is compiled on first use must not delay the first frames
    index, seen = 0, 0
    while True:
        behind = (playback.clock.now_ns() - playback.epoch_ns) * fps / 1e9
        index = max(index, int(behind))
        playback.wait_until(playback.time_of(index, fps))
        pose = script.pose_at(index / fps) if seen >= preroll else None
        yield Frame(index, playback.time_of(index, fps), film.render(pose, index))
        index, seen = index + 1, seen + 1


def filmed(script: Script, film: ActorCamera, fps: float, playback: Playback) -> Iterator[Frame]:
    """Every frame of the script, once."""
    for index in range(int(script.duration_s * fps)):
        yield Frame(index, playback.time_of(index, fps), film.render(script.pose_at(index / fps), index))
