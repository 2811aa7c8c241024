"""Take of a simulated time line, rendered and tracked, or with true poses.

Methods: the two viewers of [Two-view 5], by the improved variant, by the paper's or by the hybrid tracker, a ring of four
cameras for the hybrid tracker, or the true poses.
"""

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import msgspec

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import body_of
from zenocap.common.messages import UniversalBap, UniversalBdp
from zenocap.common.recording.opening import new_recording
from zenocap.common.rig.rig import Rig, demo_rig_file, load_rig
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import CAMERA, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP
from zenocap.services.viewer.shell import camera_info
from zenocap.services.viewer.sources.actor import filmed
from zenocap.services.viewer.sources.playback import Playback
from zenocap.simulation.ground_truth import true_bdp, truth
from zenocap.simulation.motion.timeline import EMPTY, MotionTimeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import Tracked, track_frames

Method = Literal["two-view", "two-view-paper", "hybrid-two-view", "hybrid", "truth"]

RIGS: dict[Method, str] = dict.fromkeys(get_args(Method), "demo-two-view.toml") | {"hybrid": "ring.toml"}
SIZE, FPS = (160, 120), 15.0  # [Two-view 5]
# The feet decide the facing direction.  Measured: at 160 x 120 the tracker faced backwards in 16 of 105 takes (people 108
# to 111), at 240 x 180 and other people in 17 of 315.
SIZES: dict[Method, tuple[int, int]] = dict.fromkeys(get_args(Method), SIZE) | {"hybrid": (240, 180)}
TRACKED: tuple[Method, ...] = ("hybrid-two-view", "hybrid")  # by the tracker, from silhouettes
LOGGED = (CAMERA, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE)


def dataset_rig(method: Method, size: tuple[int, int] | None = None) -> Rig:
    """Rig of a method's takes; only messages are logged, no Foxglove channels.  size: default by method.

    Raises UserError.
    """
    variant = "paper" if method == "two-view-paper" else None
    tracking = "hybrid" if method in TRACKED else None
    rig = load_rig(demo_rig_file().with_name(RIGS[method]), tracking, variant, files=False)
    rig = at_working_size(rig, size or SIZES[method], FPS)
    viewers = tuple(replace(viewer, preview=False, silhouette=method in TRACKED) for viewer in rig.viewers)
    # Without a recognizer: these takes are the training data of its models.
    return replace(rig, viewers=viewers, recognizer=None, log=msgspec.structs.replace(rig.log, foxglove=False))


def generate_take(rig: Rig, method: Method, timeline: MotionTimeline, room: int, take: Path) -> Tracked:
    """Write the take of a time line, whose empty scene at the start is the background.

    room: seed of room, light and noise.  Equal arguments give equal bytes.  Raises UserError and ValueError.
    """
    if method == "truth":
        return _write_true_poses(rig, timeline, take)
    clock = ManualClock(EPOCH_NS)
    playback = Playback(EPOCH_NS, clock, live=False)
    fps = rig.viewers[0].fps
    empty = sum(timeline.segment_at(k / fps).name == EMPTY for k in range(int(timeline.duration_s * fps)))
    rig = replace(rig, viewers=tuple(replace(viewer, background=FirstFrames(empty)) for viewer in rig.viewers))
    films = {viewer.id: SimulatedCamera(viewer.camera, timeline.person, room) for viewer in rig.viewers}
    frames = {id: filmed(timeline, film, fps, playback) for id, film in films.items()}
    return track_frames(rig, frames, clock, take, logged=LOGGED)


def _write_true_poses(rig: Rig, timeline: MotionTimeline, take: Path) -> Tracked:
    """Write the true poses as universal BAPs."""
    clock = ManualClock(EPOCH_NS)
    bus = LocalNetwork(rig.name, clock).bus()
    for topic in LOGGED:
        bus.subscribe(topic, every=True)
    body = body_of(TEN_PARTS, true_bdp(timeline.person))
    fps, poses, count = rig.viewers[0].fps, 0, int(timeline.duration_s * rig.viewers[0].fps)
    for viewer in rig.viewers:
        bus.publish(CAMERA, camera_info(viewer, EPOCH_NS))
    recording = new_recording(rig, take, EPOCH_NS, {}, overwrite=True)
    with closing(recording):
        for frame in range(count):
            captured_ns = EPOCH_NS + round(frame * 1e9 / fps)
            clock.set(captured_ns)
            pose = timeline.pose_at(frame / fps)
            if pose is not None:
                if poses == 0:
                    bus.publish(UNIVERSAL_BDP, UniversalBdp(frame=frame, captured_ns=captured_ns, body=body, ratio=1.0))
                true = truth(timeline.person, pose)
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
