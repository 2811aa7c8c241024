"""Counts of a health that say that something was lost, left out or not understood."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from zenocap.common.messages import ENDED, PROCESS

Kind = Literal["frame", "message", "step", "log", "pairing", "command"]
_OF_PAIRS = ("late", "doubled", "out_of_order", "unpaired", "unknown", "began_anew")  # of synchronizers


@dataclass(frozen=True)
class Loss:
    """name: of the count.  text: for people, "" where only programs read it.  of: counts whose sum is its total.

    summed: whether it is part of the number that `top` and the launcher show.  exported: as a reason of loss to Prometheus.
    load: whether a load test reports it.
    """

    name: str
    kind: Kind
    text: str = ""
    of: tuple[str, ...] = ()
    summed: bool = False
    exported: bool = True
    load: bool = False


_CAMERA = ("frames", "dropped_frames", "skipped_frames")

LOSSES: tuple[Loss, ...] = (
    Loss("dropped_frames", "frame", "camera frames dropped", _CAMERA, summed=True, load=True),
    Loss("skipped_frames", "frame", "camera frames skipped under overload", _CAMERA, summed=True, load=True),
    Loss("dropped_instants", "frame", "frame sets skipped", summed=True, load=True),
    Loss("late_answers", "message", load=True),
    Loss("dropped_superseded", "message", exported=False, load=True),  # normal, and a family of its own
    Loss("dropped_queue_full", "message", "messages dropped", ("received",), summed=True, load=True),
    Loss("dropped_too_many_keys", "message"),
    Loss("rejected_invalid", "message", "messages invalid", ("received",), summed=True),
    Loss("rejected_version", "message", summed=True),
    Loss("rejected_names", "message", summed=True),
    Loss("rejected_size", "message", summed=True),
    Loss("step_errors", "step", "steps failed", summed=True, load=True),
    Loss("unsendable", "message", summed=True),
    Loss("unusable", "message"),
    Loss("log_lost", "log", "messages not recorded", ("log_messages", "log_lost"), summed=True, load=True),
    Loss("log_unshown", "log"),
    Loss("log_rejected", "log"),
    *(Loss(name, "pairing") for name in ("late", "gap", "other_body", "alone")),
    Loss("damaged", "frame"),
    *(Loss(f"{what}_{why}", "pairing") for what in ("silhouette", "sighting", "bap", "bdp") for why in _OF_PAIRS),
    Loss("commands_failed", "command", "commands failed", exported=False),
    Loss("commands_dropped", "command", "commands dropped", exported=False),
)
# Counts of a health that are measured anew each time: those of several processes of a service have no sum.
MEASURED = frozenset({
    "queued", "kept_percent", "phase_us", "source_frames_per_1000_s", "source_jitter_us", "camera_skew_us", "log_on",
    "log_stopped", "log_closed", "log_free_mb", "certificate_days", PROCESS, ENDED,
})  # fmt: skip
SUMMED = tuple(one.name for one in LOSSES if one.summed)
EXPORTED = tuple(one.name for one in LOSSES if one.exported)
OF_LOAD = tuple(one.name for one in LOSSES if one.load)


def lost(counts: Mapping[str, int]) -> int:
    """The number of losses that is shown of a service."""
    return sum(counts.get(name, 0) for name in SUMMED)


def described(counts: Mapping[str, int]) -> list[tuple[str, str, int, int]]:
    """The losses of a service: name, text, number, and total, 0 where that is not counted."""
    return [
        (one.name, one.text, counts[one.name], sum(counts.get(name, 0) for name in one.of))
        for one in LOSSES
        if one.text and counts.get(one.name)
    ]
