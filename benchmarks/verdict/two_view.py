"""Two-view takes of trials: the steps of both viewers and the integrator on the silhouettes of a scene, without a bus."""

import time
from collections.abc import Iterator, Mapping

from benchmarks.verdict.faults import Scene
from benchmarks.verdict.messages import EPOCH_NS, camera_messages, envelope, silhouette
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.sources import FirstFrames
from zenocap.services.integrator import step as integrator
from zenocap.services.viewer import states as viewer_states
from zenocap.services.viewer import step as viewer
from zenocap.services.viewer.frame import SegmentedFrame

LEARNT = FirstFrames(1)  # silhouettes are given: there is no background to learn


class TwoView:
    """State of both viewers and the integrator."""

    def __init__(self, scene: Scene) -> None:
        self._integrator_setup = integrator.integrator_setup(TEN_PARTS, scene.cameras, round(1e9 / scene.fps), None)
        self._integrator = integrator.initial_state(self._integrator_setup)
        self._setups: Mapping[str, viewer_states.Setup] = {
            view: viewer_states.viewer_setup(view, camera, LEARNT, publish_silhouette=False)
            for view, camera in scene.cameras.items()
        }
        self._viewers: dict[str, viewer_states.State] = {
            view: viewer.initial_state(setup) for view, setup in self._setups.items()
        }

    def process(self, view: str, frame: SegmentedFrame) -> Iterator[m.Message]:
        """Process a silhouette of one view; yield all messages."""
        self._viewers[view], messages = viewer.step(self._setups[view], self._viewers[view], frame)
        while messages:
            yield from messages
            answers: list[m.Message] = []
            for message in messages:
                try:
                    self._integrator, more = integrator.step(self._integrator_setup, self._integrator, envelope(message))
                except ValueError:  # an invalid message, which a service counts and drops
                    continue
                answers += more
            yield from answers
            messages = [reply for answer in answers for reply in self._replies(answer)]

    def _replies(self, message: m.Message) -> list[m.Message]:
        """Messages of the viewers in reply to one of the integrator."""
        replies: list[m.Message] = []
        for view, setup in self._setups.items():
            self._viewers[view], more = viewer.step(setup, self._viewers[view], envelope(message))
            replies += more
        return replies


def two_view_messages(scene: Scene) -> tuple[list[m.Message], float]:
    """Messages of a take in their order, and the processor time in seconds."""
    found: list[m.Message] = list(camera_messages(scene))
    system, started_s = TwoView(scene), time.process_time()
    for k in range(max(scene.first, 1) - 1, len(next(iter(scene.masks.values())))):
        captured_ns = EPOCH_NS + round(k * 1e9 / scene.fps)
        for view in scene.cameras:
            mask = scene.masks[view][k]
            found.append(silhouette(view, k, captured_ns, mask))
            found += system.process(view, SegmentedFrame(k, captured_ns, mask if mask.any() else None))
    return found, time.process_time() - started_s
