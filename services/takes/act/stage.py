"""The actor filmed and tracked: a script goes in, and out comes a take with the poses that the services found.

The two viewers of [Two-view 5], a ring of four for the hybrid tracker, or nobody at all: then the true poses are logged.
"""

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Literal

import msgspec

from common.actor.render import ActorCamera
from common.actor.script import EMPTY, Script
from common.actor.truth import true_bdp, truth
from common.body.anatomy import TEN_PARTS
from common.bus.local import LocalNetwork
from common.bus.protocol import Envelope
from common.conversion import body_of
from common.messages import UniversalBap, UniversalBdp
from common.runtime.clock import ManualClock
from common.runtime.rig import Rig, demo_rig_file, load_rig
from common.runtime.specs import FirstFrames
from common.take.opening import new_recording
from common.topics import CAMERA, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP
from services.takes.track import EPOCH_NS, Tracked, at_working_size, track_frames
from services.viewer.shell import camera_info
from services.viewer.sources.actor import filmed
from services.viewer.sources.frame import Playback

Method = Literal["two-view", "hybrid", "truth"]

RIGS = {"two-view": "demo.toml", "hybrid": "ring.toml", "truth": "demo.toml"}
SIZE, FPS = (160, 120), 15.0  # [Two-view 5]
# Who faces which way is told by the feet: at 160 x 120 the tracker had 16 of 105 takes facing backwards (people 108 to
# 111), at 240 x 180, of other people, still 17 of 315.
SIZES = {"two-view": SIZE, "hybrid": (240, 180), "truth": SIZE}
LOGGED = (CAMERA, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE)


def stage(method: Method, size: tuple[int, int] | None = None, fps: float = FPS) -> Rig:
    """The rig that a method's takes are filmed with; nothing beside the messages is logged.  size: default by method.

    Raises RigError.
    """
    rig = at_working_size(load_rig(demo_rig_file().with_name(RIGS[method]), files=False), size or SIZES[method], fps)
    viewers = tuple(replace(viewer, preview=False, silhouette=method == "hybrid") for viewer in rig.viewers)
    # Without a recogniser: models are learnt from these takes.
    return replace(rig, viewers=viewers, recognizer=None, log=msgspec.structs.replace(rig.log, foxglove=False))


def act(rig: Rig, method: Method, script: Script, room: int, take: Path) -> Tracked:
    """Write the take of a script, whose empty scene at the start is the background.  room: seed of what is filmed.

    The same arguments give the same bytes.  Raises RecordingError, SourceError and ValueError.
    """
    if method == "truth":
        return _true(rig, script, take)
    clock = ManualClock(EPOCH_NS)
    playback = Playback(EPOCH_NS, clock, live=False)
    fps = rig.viewers[0].fps
    empty = sum(script.segment_at(k / fps).name == EMPTY for k in range(int(script.duration_s * fps)))
    rig = replace(rig, viewers=tuple(replace(viewer, background=FirstFrames(empty)) for viewer in rig.viewers))
    films = {viewer.id: ActorCamera(viewer.camera, script.person, room) for viewer in rig.viewers}
    frames = {id: filmed(script, film, fps, playback) for id, film in films.items()}
    return track_frames(rig, frames, clock, take, logged=LOGGED)


def _true(rig: Rig, script: Script, take: Path) -> Tracked:
    """The true poses as universal BAPs, which nobody had to find."""
    clock = ManualClock(EPOCH_NS)
    bus = LocalNetwork(rig.name, clock).bus()
    for topic in LOGGED:
        bus.subscribe(topic, every=True)
    body = body_of(TEN_PARTS, true_bdp(script.person))
    fps, poses, count = rig.viewers[0].fps, 0, int(script.duration_s * rig.viewers[0].fps)
    for viewer in rig.viewers:
        bus.publish(CAMERA, camera_info(viewer, EPOCH_NS))
    recording = new_recording(rig, take, EPOCH_NS, overwrite=True)
    with closing(recording):
        for frame in range(count):
            captured_ns = EPOCH_NS + round(frame * 1e9 / fps)
            clock.set(captured_ns)
            pose = script.pose_at(frame / fps)
            if pose is not None:
                if poses == 0:
                    bus.publish(UNIVERSAL_BDP, UniversalBdp(frame=frame, captured_ns=captured_ns, body=body, ratio=1.0))
                true = truth(script.person, pose)
                x, y, z = true.joints["Hip"].tolist()
                bap = UniversalBap(
                    frame=frame, captured_ns=captured_ns, position=(x, y, z), angles=dict(true.angles), scores={},
                    views={}, stale=[], lost=[],
                )  # fmt: skip
                bus.publish(UNIVERSAL_BAP, bap)
                poses += 1
            while isinstance(event := bus.receive(), Envelope):
                recording.record(event)
    written = recording.statistics
    return Tracked(count, poses, written.messages, () if written.failure is None else (written.failure,), {})
