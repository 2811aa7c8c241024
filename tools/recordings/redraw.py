"""The frame sets of a rig's files, read again, with the messages of the take that was made of them."""

from collections.abc import Iterator
from pathlib import Path

from zenocap.common.messages import Message
from zenocap.common.recording.reader import Take
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.session.lookahead import Lookahead, limited_threads
from zenocap.common.topics import CAMERA
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.recordings.inputs import Inputs
from zenocap.tools.recordings.track import TrackedFrameSet, available_cores, opened, tolerance_ns


def frame_sets_again(rig: Rig, take: Path, jobs: int | None = None) -> Iterator[TrackedFrameSet]:
    """Yield the frame sets of `track`, decoded again but not processed, with their messages from its take.

    jobs: number of cores to use; default: the available ones.  Raises UserError for a take that cannot be read.
    """
    jobs = available_cores() if jobs is None else jobs
    clock, inputs = ManualClock(EPOCH_NS), Inputs()
    with limited_threads(jobs), Lookahead(jobs) as lookahead:
        sources = {id: lookahead.ahead(frames) for id, frames in opened(rig, clock, inputs).items()}
        received = Take(take).envelopes(invalid="raise")
        following = next(received, None)
        for frames in inputs.frame_sets(sources, tolerance_ns(rig)):
            now_ns = max(frame.captured_ns for frame in frames.values())
            clock.set(now_ns)
            messages: list[Message] = []
            # `track` has set its clock to this time; cameras come first, before a separate video of the T-pose.
            while following is not None and (following.topic is CAMERA or following.received_ns <= now_ns):
                messages.append(following.message)
                following = next(received, None)
            yield TrackedFrameSet(frames, tuple(messages))
