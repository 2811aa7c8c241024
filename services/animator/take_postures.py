"""The recognized postures of a take for the page, on the position of the player."""

from collections.abc import Callable
from pathlib import Path

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.recording.indexed import indexed_messages
from zenocap.common.recording.summary import Summary
from zenocap.common.topics import POSTURE, topic_at
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.parameters import MAX_SHOWN_POSTURES


def postures_update(path: Path, summary: Summary, stopped: Callable[[], bool]) -> pm.PosturesUpdate:
    """The first MAX_SHOWN_POSTURES postures, in seconds from the beginning of the take.

    Reads what has postures, at most until `stopped`; what cannot be read is left out, and the replay reports it.
    """
    parts: list[pm.PosturePart] = []
    postures = indexed_messages(path, summary, lambda channel: topic_at(channel.topic) is POSTURE)
    for chunk in postures.chunks:
        if stopped() or len(parts) >= MAX_SHOWN_POSTURES:
            break
        try:
            found = postures.of(chunk)
        except OSError:
            break
        for recorded in found:
            try:
                posture = codec.decode(recorded.data, m.Posture)
            except codec.BadMessage:
                continue
            if posture.label is not None:
                span_s = ((posture.start_ns - summary.start_ns) / 1e9, (posture.end_ns - summary.start_ns) / 1e9)
                parts.append(pm.PosturePart(max(0.0, span_s[0]), max(0.0, span_s[1]), posture.label))
    return pm.PosturesUpdate(parts[:MAX_SHOWN_POSTURES])
