"""Recomputation of the poses from both directions."""

from collections.abc import Mapping
from pathlib import Path

from zenocap.common import codec
from zenocap.common.errors import UserError
from zenocap.common.messages import BothWaysPose, TrackerPose
from zenocap.common.recording.reader import Take
from zenocap.common.recording.setup_file import PRIOR_FILE, RecordedRig
from zenocap.common.topics import BOTH_WAYS_POSE
from zenocap.services.tracker import shell as tracker_shell
from zenocap.tools.recordings.both_ways import both_ways, both_ways_message
from zenocap.tools.recordings.track import available_cores
from zenocap.tools.verify.result import Difference, Reason, Verification, difference
from zenocap.tools.verify.take_messages import messages_of

TRACKER = ("tracker", "main")


def verify_both_ways(
    path: Path, rig: RecordedRig, attached: Mapping[str, bytes], found: Verification, tolerance: float
) -> None:
    """Add the poses from both directions of a take in one file to `found`; what prevents it becomes a reason.

    attached: attachments of the take.
    """
    key = BOTH_WAYS_POSE.at(rig.name)
    try:
        setup = tracker_shell.setup_of(rig, tracker_shell.prior_in(rig, path, attached.get(PRIOR_FILE)))
        poses = both_ways(path, rig.name, setup, jobs=available_cores())
    except (UserError, ValueError) as error:
        found.reasons.append(Reason(TRACKER, f"poses from both directions: {error}"))
        found.unchecked[key] += sum(isinstance(received.message, BothWaysPose) for received in messages_of(Take(path)))
        return
    forward: dict[int, TrackerPose] = {}
    for received in messages_of(Take(path)):
        logged = received.message
        if not isinstance(logged, BothWaysPose):
            if isinstance(logged, TrackerPose):
                forward = {logged.captured_ns: logged}  # each is followed by its pose from both directions
            continue
        if logged.captured_ns not in forward or logged.captured_ns not in poses:
            found.unchecked[key] += 1
            found.reasons.append(Reason(TRACKER, f"pose from both directions of frame {logged.frame}: no forward pose"))
            continue
        recomputed = both_ways_message(setup, forward[logged.captured_ns], poses[logged.captured_ns])
        differs = difference(key, logged, recomputed, tolerance)
        exact = codec.encode(recomputed) == received.data
        if exact or (tolerance and differs is None):
            found.equal[key] += 1
            found.close += not exact
            continue
        found.different[key] += 1
        if found.first is None:
            found.first = differs or Difference(key, logged.frame, logged.captured_ns, ("the same fields in other bytes",))
