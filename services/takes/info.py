"""`zenocap info`: what is in a take."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from common.take.reading import Take


@dataclass(frozen=True)
class Channel:
    """key: of the messages.  rate: per second over the take; 0 for a single one."""

    key: str
    schema: str
    messages: int
    bytes: int
    rate: float


@dataclass(frozen=True)
class Info:
    """start_ns: of the first message, since the Unix epoch.  cut: what is missing, None for a whole file."""

    path: str
    size_bytes: int
    start_ns: int
    duration_s: float
    messages: int
    cut: str | None
    channels: tuple[Channel, ...]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, int]


def info(path: Path) -> Info:
    """What the take at `path` has.  Raises TakeError."""
    take = Take(path)
    counts: Counter[tuple[str, str]] = Counter()
    sizes: Counter[tuple[str, str]] = Counter()
    first: dict[tuple[str, str], int] = {}
    last: dict[tuple[str, str], int] = {}
    for recorded in take.messages():
        channel = (recorded.topic, recorded.schema)
        counts[channel] += 1
        sizes[channel] += len(recorded.data)
        first[channel] = min(first.get(channel, recorded.log_ns), recorded.log_ns)
        last[channel] = max(last.get(channel, recorded.log_ns), recorded.log_ns)
    channels = tuple(
        Channel(key, schema, count, sizes[key, schema], _rate(count, last[key, schema] - first[key, schema]))
        for (key, schema), count in sorted(counts.items())
    )
    start_ns = min(first.values(), default=0)
    return Info(
        path=str(path),
        size_bytes=path.stat().st_size,
        start_ns=start_ns,
        duration_s=(max(last.values(), default=0) - start_ns) / 1e9,
        messages=sum(counts.values()),
        cut=take.cut,
        channels=channels,
        metadata=take.metadata,
        attachments={name: len(data) for name, data in take.attachments.items()},
    )


def _rate(count: int, span_ns: int) -> float:
    return (count - 1) * 1e9 / span_ns if span_ns > 0 else 0.0
