"""Delays of the cameras that a rig file may ask for."""

from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.file import DELAYS, Delays, RigFile
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.viewers import Viewer


def delays_of(path: Path, content: RigFile, method: str) -> Delays:
    """Whether delays of the cameras are estimated and corrected.  Raises UserError."""
    if content.delays == "follow" and not method_of(method).has_tracker:
        raise UserError(
            f"{path}: delays = 'follow': allowed for method {method!r}, without a tracker: off, report; "
            "zenocap sync TAKE finds delay_ms of the viewers"
        )
    return next(one for one in DELAYS if one == content.delays)


def check_delays(path: Path, method: str, viewers: tuple[Viewer, ...]) -> None:
    """Raises UserError when the cameras of a rig without a tracker are a frame period or more apart.

    Each of its viewers gets the assignment of a frame before its next frame only if the others have seen that frame set.
    """
    if method_of(method).has_tracker:
        return
    early, *_, late = sorted(viewers, key=lambda viewer: viewer.delay_ns)
    period_ns = 1e9 / min(viewer.fps for viewer in viewers)
    apart_ns = late.delay_ns - early.delay_ns
    if apart_ns >= period_ns:
        raise UserError(
            f"{path}: delay_ms of viewer {late.id} is {apart_ns / 1e6:g} ms above that of viewer {early.id}: "
            f"allowed for method {method!r}: less than a frame period, {period_ns / 1e6:.1f} ms; "
            "the methods with a tracker wait for late cameras"
        )
