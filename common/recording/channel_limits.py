"""Limits of the channels of a recording or an output, against invented names on an open network.

Keys of the rig's own services, and of topics without names in their key, are always admitted.  Of other keys, each topic
has MAX_UNKNOWN_KEYS, which bounds memory and the size of the file.
"""

import logging
from collections import Counter
from collections.abc import Collection
from pathlib import Path

from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import is_of, topic_at

logger = logging.getLogger(__name__)

MAX_CHANNELS = 4096  # of keys that are no topic's, such as those of other programs; chosen by hand
MAX_UNKNOWN_KEYS = 256  # of each topic, of services that the rig does not run, such as recorders; chosen by hand


class ChannelLimits:
    """Decides which keys are used.  rig: its name.  own: the services that it runs.  user: for the log line."""

    def __init__(self, user: Path | str, rig: str, own: Collection[ServiceKey]) -> None:
        self._user, self._rig, self._own = user, rig, frozenset(own)
        self._admitted: set[str] = set()
        self._unknown: Counter[str] = Counter()
        self._logged: set[str] = set()

    def admits(self, key: str) -> bool:
        """Whether messages on a key are used: decided when it comes first; a refusal is logged once per topic."""
        if key in self._admitted:
            return True
        topic = topic_at(key)
        kind, limit = (topic.name, MAX_UNKNOWN_KEYS) if topic is not None else ("", MAX_CHANNELS)
        if not is_of(self._own, self._rig, topic.names(key) if topic is not None else None):
            if self._unknown[kind] >= limit:
                self._log(kind, key, limit)
                return False
            self._unknown[kind] += 1
        self._admitted.add(key)
        return True

    def _log(self, kind: str, key: str, limit: int) -> None:
        if kind not in self._logged:
            self._logged.add(kind)
            what = f"keys of {kind}" if kind else "keys"
            logger.warning(
                "%s: %s and further keys are left out: limit of %d %s of other programs", self._user, key, limit, what
            )
