"""The recognized postures of a take for the page, on the position of the player."""

from collections.abc import Callable
from pathlib import Path

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import Take
from zenocap.common.topics import POSTURE, topic_at
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.parameters import MAX_SHOWN_POSTURES


def postures_update(path: Path, start_ns: int, stopped: Callable[[], bool]) -> pm.PosturesUpdate:
    """The first MAX_SHOWN_POSTURES postures, in seconds from start_ns, the beginning of the take.

    Reads the whole take, at most until `stopped`; what cannot be read is left out, and the replay reports it.
    """
    parts: list[pm.PosturePart] = []
    try:
        for recorded in Take(path).messages():
            if stopped() or len(parts) >= MAX_SHOWN_POSTURES:
                break
            if topic_at(recorded.topic) is not POSTURE:
                continue
            try:
                posture = codec.decode(recorded.data, m.Posture)
            except codec.BadMessage:
                continue
            if posture.label is not None:
                span_s = (posture.start_ns - start_ns) / 1e9, (posture.end_ns - start_ns) / 1e9
                parts.append(pm.PosturePart(max(0.0, span_s[0]), max(0.0, span_s[1]), posture.label))
    except (UserError, OSError):
        pass
    return pm.PosturesUpdate(parts)
