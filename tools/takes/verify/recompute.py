"""Recomputation of a take: messages of its services, poses of both passes, verdict.

They must equal those of the take byte for byte.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.messages import BothWaysPose, TrackerPose, Verdict
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import RecordedRig
from zenocap.common.session.lookahead import available_cores
from zenocap.common.topics import BOTH_WAYS_POSE
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.verdict import verdict_of
from zenocap.tools.takes.both_ways import both_ways, both_ways_message
from zenocap.tools.takes.members import tracker_setup
from zenocap.tools.takes.verify.input_traces import Recomputation
from zenocap.tools.takes.verify.result import Reason, Verification
from zenocap.tools.takes.verify.take_messages import first_trace_ns, messages_of, setup_in

UPDATE_EVERY = 256  # messages between two calls of `watch`
TRACKER = ("tracker", "main")


def verify(paths: Sequence[Path], tolerance: float = 0.0, watch: Callable[[int], None] = lambda _: None) -> Verification:
    """Verify one take, or the parts of one in any order.  watch: is called with the number of messages read.

    tolerance: allowed difference of numbers, relative or absolute.  Raises UserError for a file that is not a take or has
    no setup.
    """
    check: Recomputation | None = None
    count, two_passes = 0, False
    evidence = TakeEvidence()
    verdict: tuple[Envelope, Verdict] | None = None  # recorded, and on the messages before it
    for path in sorted(paths, key=first_trace_ns) if len(paths) > 1 else paths:
        take = TakeReader(path)
        for received in messages_of(take):
            if check is None:
                check = Recomputation(path, setup_in(path, take), take.attachments, tolerance)
                check.found.versions = take.metadata.get("versions", {})
            check.add(received)
            if isinstance(received.message, Verdict):
                verdict = received, verdict_of(evidence)
            evidence.add(received.message)
            count += 1
            two_passes = two_passes or isinstance(received.message, BothWaysPose)
            if count % UPDATE_EVERY == 0:
                watch(count)
        if take.cut and check is not None:
            check.found.reasons.append(Reason(None, take.cut))
    if check is None:
        raise UserError(f"{paths[0]}: no message of zenocap in it: there is nothing to verify")
    check.close()
    if two_passes and len(paths) == 1 and not take.cut:
        _verify_both_ways(paths[0], check.rig, take.attachments, check.found, tolerance)
    elif two_passes:
        check.found.reasons.append(Reason(None, "poses from both directions: only of a whole take in one file"))
    if not check.found.checked:
        reasons = "; ".join(map(str, check.found.reasons)) or "no service has published its input trace"
        raise UserError(f"{paths[0]}: nothing can be verified: {reasons}")
    if verdict is not None:
        _verify_verdict(*verdict, check.found, tolerance, whole=len(paths) == 1)
    return check.found


def _verify_both_ways(
    path: Path, rig: RecordedRig, attached: Mapping[str, bytes], found: Verification, tolerance: float
) -> None:
    """Add the poses from both directions of a take in one file to `found`; what prevents it becomes a reason.

    attached: attachments of the take.
    """
    key = BOTH_WAYS_POSE.at(rig.name)
    try:
        setup = tracker_setup(rig, path, attached)
        poses = both_ways(path, rig.name, setup, jobs=available_cores())
    except (UserError, ValueError) as error:
        found.reasons.append(Reason(TRACKER, f"poses from both directions: {error}"))
        found.unchecked[key] += sum(
            isinstance(received.message, BothWaysPose) for received in messages_of(TakeReader(path))
        )
        return
    forward: dict[int, TrackerPose] = {}
    for received in messages_of(TakeReader(path)):
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
        differs = found.compare(received, codec.encode(recomputed), tolerance)
        found.first = found.first or differs


def _verify_verdict(received: Envelope, recomputed: Verdict, found: Verification, tolerance: float, *, whole: bool) -> None:
    """Compare a recorded verdict with the recomputed one, and add the result to `found`, that of all other messages.

    whole: whether the take is in one file; of several, or when other messages differ or could not be checked, the verdict
    rests on something else and is not checked.
    """
    if not whole or found.failed or not found.complete:
        found.unchecked[received.key] += 1
        if not found.reasons:
            found.reasons.append(Reason(None, "verdict: it rests on messages that differ, or the take is in several files"))
        return
    found.first = found.compare(received, codec.encode(recomputed), tolerance)
