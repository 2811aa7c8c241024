"""Compare the verdict of a take with that on the messages before it."""

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Verdict
from zenocap.tools.verify.result import Difference, Reason, Verification, difference


def verify_verdict(received: Envelope, recomputed: Verdict, found: Verification, tolerance: float, *, whole: bool) -> None:
    """Compare a recorded verdict with the recomputed one, and add the result to `found`, that of all other messages.

    whole: whether the take is in one file; of several, or when other messages differ or could not be checked, the verdict
    rests on something else and is not checked.
    """
    logged = received.message
    if not whole or found.failed or not found.complete:
        found.unchecked[received.key] += 1
        if not found.reasons:
            found.reasons.append(Reason(None, "verdict: it rests on messages that differ, or the take is in several files"))
        return
    differs = difference(received.key, logged, recomputed, tolerance)
    exact = codec.encode(recomputed) == received.data
    if exact or (tolerance and differs is None):
        found.equal[received.key] += 1
        found.close += not exact
        return
    found.different[received.key] += 1
    fields = ("the same fields in other bytes",)
    found.first = differs or Difference(received.key, logged.frame, logged.captured_ns, fields)
