"""Recompute the verdict of a take from the messages before it."""

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Verdict
from zenocap.tools.verdict.evidence import Evidence
from zenocap.tools.verdict.verdict import verdict_of
from zenocap.tools.verify.result import Difference, Reason, Verification, difference


def verify_verdict(received: Envelope, evidence: Evidence, found: Verification, tolerance: float, *, whole: bool) -> None:
    """Compare a recorded verdict with that on the evidence before it, and add the result to `found`.

    whole: whether the take is in one file; of several, the evidence is not complete.
    """
    logged = received.message
    assert isinstance(logged, Verdict)
    if not whole:
        found.unchecked[received.key] += 1
        found.reasons.append(Reason(None, "verdict: only of a whole take in one file"))
        return
    recomputed = verdict_of(evidence)
    differs = difference(received.key, logged, recomputed, tolerance)
    exact = codec.encode(recomputed) == received.data
    if exact or (tolerance and differs is None):
        found.equal[received.key] += 1
        found.close += not exact
        return
    found.different[received.key] += 1
    if found.first is None:
        fields = ("the same fields in other bytes",)
        found.first = differs or Difference(received.key, logged.frame, logged.captured_ns, fields)
