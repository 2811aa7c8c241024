"""How long a disk lasts: said before it is full."""

import logging
import shutil
from pathlib import Path

logger = logging.getLogger(__name__)

FEW_BYTES = 1_000_000_000
FEW_S = 600.0


class Space:
    """Warns once when the disk of `folder` is nearly full, and again after it was not."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._warned = False
        self.free_bytes: int | None = None  # at the last look; None where the system does not tell

    def look(self, bytes_per_s: float) -> None:
        """bytes_per_s: written now."""
        try:
            self.free_bytes = shutil.disk_usage(self._folder).free
        except OSError:
            self.free_bytes = None
            return
        words = shortage(self.free_bytes, bytes_per_s)
        if words and not self._warned:
            logger.warning("%s: %s", self._folder, words)
        self._warned = words is not None


def shortage(free_bytes: int, bytes_per_s: float) -> str | None:
    """In words, when less than FEW_BYTES or FEW_S are left; None when there is enough."""
    left_s = free_bytes / bytes_per_s if bytes_per_s > 0 else float("inf")
    if free_bytes >= FEW_BYTES and left_s >= FEW_S:
        return None
    lasts = f", {left_s / 60:.0f} minutes at the present rate" if left_s < 100 * FEW_S else ""
    return f"the disk is nearly full: {free_bytes / 1e6:.0f} MB free{lasts}"
