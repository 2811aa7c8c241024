"""The postures that a take says were recognised, for the captions of its pictures."""

from dataclasses import dataclass
from pathlib import Path

from common.codec import BadMessage
from common.messages import Posture
from common.take.reading import Take, envelope
from common.topics import POSTURE, topic_at


@dataclass(frozen=True)
class Span:
    """What was done between two moments, both included, nanoseconds since the Unix epoch."""

    label: str
    start_ns: int
    end_ns: int


def read_labels(take: Path) -> tuple[Span, ...]:
    """The postures of a take, by their beginnings; those that no model explains are left out.  Raises TakeError."""
    found = []
    for recorded in Take(take).messages():
        if topic_at(recorded.topic) is not POSTURE:
            continue
        try:
            received = envelope(recorded)
        except BadMessage:
            continue  # a version of ours that this one does not read
        if received is not None and isinstance(received.message, Posture) and received.message.label is not None:
            found.append(Span(received.message.label, received.message.start_ns, received.message.end_ns))
    return tuple(sorted(found, key=lambda span: span.start_ns))


def label_at(spans: tuple[Span, ...], at_ns: int) -> str:
    """The posture of a moment, of several that which began last; "" for none."""
    return next((span.label for span in reversed(spans) if span.start_ns <= at_ns <= span.end_ns), "")
