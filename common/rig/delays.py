"""Delays of the cameras that a rig file may ask for."""

from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.common.rig.file import DELAYS, Delays, RigFile
from zenocap.common.rig.methods import Method
from zenocap.common.rig.viewers import Viewer


def checked_delays(path: Path, content: RigFile, method: Method, viewers: tuple[Viewer, ...]) -> Delays:
    """Whether delays of the cameras are estimated and corrected.

    Raises UserError when that needs a tracker, or when the cameras of a rig without one are a frame period or more apart:
    each of its viewers gets the assignment of a frame before its next frame only if the others have seen that instant.
    """
    if not method.has_tracker:
        early, *_, late = sorted(viewers, key=lambda viewer: viewer.delay_ns)
        period_ns = 1e9 / min(viewer.fps for viewer in viewers)
        apart_ns = late.delay_ns - early.delay_ns
        if apart_ns >= period_ns:
            raise UserError(
                f"{path}: delay_ms of viewer {late.id} is {apart_ns / 1e6:g} ms above that of viewer {early.id}: "
                f"allowed for method {method.name!r}: less than a frame period, {period_ns / 1e6:.1f} ms; "
                "the methods with a tracker wait for late cameras"
            )
        if content.delays == "follow":
            raise UserError(
                f"{path}: delays = 'follow': allowed for method {method.name!r}, without a tracker: off, report; "
                "zenocap sync TAKE finds delay_ms of the viewers"
            )
    return next(one for one in DELAYS if one == content.delays)
