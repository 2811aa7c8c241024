"""Verdict and recognized postures of a take for the page, as parts on the position of the player."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.recording.summary import Summary, last_message, messages_in
from zenocap.common.topics import POSTURE, VERDICT
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.parameters import MAX_SHOWN_POSTURES


def verdict_update(path: Path) -> pm.VerdictUpdate:
    """The verdict that a take ends with; without parts, and with rating "", for a take that has none or is cut."""
    try:
        found = last_message(path, VERDICT)
        if found is not None:
            data, summary = found
            return shown(codec.decode(data, m.Verdict), summary.start_ns)
    except (OSError, codec.BadMessage):  # damaged: the replay reports it
        pass
    return pm.VerdictUpdate()


def shown(verdict: m.Verdict, start_ns: int) -> pm.VerdictUpdate:
    """start_ns: of the take, from which the seconds count.  Stretches of equal class in a row are one part."""
    parts = []
    for rating, group in groupby(verdict.stretches, key=lambda one: one.rating):
        stretches = list(group)
        error_m = sum(one.error for one in stretches) / len(stretches)
        reasons = list(dict.fromkeys(kind for one in stretches for kind in one.reasons))
        span_s = (stretches[0].start_ns - start_ns) / 1e9, (stretches[-1].end_ns - start_ns) / 1e9
        parts.append(pm.VerdictPart(max(0.0, span_s[0]), max(0.0, span_s[1]), rating, error_m, reasons))
    return pm.VerdictUpdate(verdict.rating, [one.text for one in verdict.reasons], parts)


def postures_update(path: Path, summary: Summary, stopped: Callable[[], bool]) -> pm.PosturesUpdate:
    """The first MAX_SHOWN_POSTURES postures, in seconds from the beginning of the take.

    Reads what has postures, at most until `stopped`; what cannot be read is left out, and the replay reports it.
    """
    parts: list[pm.PosturePart] = []
    wanted, chunks = summary.with_messages(POSTURE)
    for chunk in chunks:
        if stopped() or len(parts) >= MAX_SHOWN_POSTURES:
            break
        try:
            found = messages_in(path, chunk, wanted)
        except OSError:
            break
        for data in found:
            try:
                posture = codec.decode(data, m.Posture)
            except codec.BadMessage:
                continue
            if posture.label is not None:
                span_s = ((posture.start_ns - summary.start_ns) / 1e9, (posture.end_ns - summary.start_ns) / 1e9)
                parts.append(pm.PosturePart(max(0.0, span_s[0]), max(0.0, span_s[1]), posture.label))
    return pm.PosturesUpdate(parts[:MAX_SHOWN_POSTURES])
