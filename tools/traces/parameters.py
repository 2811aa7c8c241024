"""Limits of the traces."""

from typing import Final

MATCH_NS: Final = 40_000_000  # capture times of views of one instant and of its pose; as synchronizers pair at 15 frames/s
KEPT: Final = 256  # messages of each kind and viewer that wait for their pose: 4 s at 60 frames/s
MAX_AGE_NS: Final = 60_000_000_000  # older poses are of a replayed take

MOST_VIEWERS: Final = 64  # of a rig, as messages allow; further names are ignored
EXPORT_TIMEOUT_S: Final = 5.0
