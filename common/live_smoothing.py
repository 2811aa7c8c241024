"""Smoothing of pose messages while they arrive."""

import msgspec

from zenocap.common import messages as m
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.one_euro import Filtered, OneEuro, filtered
from zenocap.common.conversion import Bap, anatomy_of, angles_by_name, is_lost, pose_of
from zenocap.common.errors import UserError
from zenocap.common.rig.animator import SMOOTHINGS, AnimatorTable, smoothing_problem


class LiveSmoothing:
    """Filter of the poses of one rig: one for each method that publishes poses.

    It starts again with a new body, and after a lost person, a gap or a jump, see `one_euro.filtered`.
    """

    def __init__(self, options: OneEuro) -> None:
        self._options = options
        self._anatomies: dict[type[m.Message], Anatomy] = {}
        self._last: dict[type[m.Message], Filtered] = {}

    def message(self, message: m.Message) -> m.Message:
        """Return a pose message with the smoothed pose, and every other message as it is."""
        match message:
            case m.UniversalBdp(body=body):
                self._define(m.UniversalBap, body)
            case m.TrackerBdp(body=body):
                self._define(m.TrackerPose, body)
            case m.UniversalBap() | m.TrackerPose():
                return self._pose(message)
        return message

    def _define(self, kind: type[m.Message], body: m.Body) -> None:
        """Set the anatomy; the sizes of a body may change in motion, which does not restart the filter."""
        try:
            anatomy = anatomy_of(body)
        except ValueError:  # of another version; its poses pass as they are
            self._anatomies.pop(kind, None)
            self._last.pop(kind, None)
            return
        if self._anatomies.get(kind) is not anatomy:
            self._last.pop(kind, None)
        self._anatomies[kind] = anatomy

    def _pose(self, message: Bap) -> Bap:
        kind = type(message)
        anatomy = self._anatomies.get(kind)
        if anatomy is None:
            return message
        if is_lost(message):
            self._last.pop(kind, None)
            return message
        try:
            pose = pose_of(anatomy, message)
        except ValueError:
            return message
        self._last[kind], smooth = filtered(anatomy, self._options, self._last.get(kind), message.captured_ns, pose)
        x, y, z = smooth.position.tolist()
        return msgspec.structs.replace(message, position=(x, y, z), angles=angles_by_name(anatomy, smooth.angles))


def live_smoothing(smooth: str, hz: float | None = None, beta: float | None = None) -> LiveSmoothing | None:
    """Filter of the options `smooth`, `smooth_hz` and `smooth_beta` of a rig's animator; None for "off".

    Raises UserError, whose text names the key, its value and the allowed values.
    """
    problem = smoothing_problem(smooth, hz, beta)
    if problem is not None:
        raise UserError(problem)
    if smooth == SMOOTHINGS[0]:
        return None
    default = OneEuro()
    return LiveSmoothing(OneEuro(default.hz if hz is None else hz, default.beta if beta is None else beta))


def animator_smoothing(table: AnimatorTable) -> LiveSmoothing | None:
    """Filter of a rig's `[animator]` table; None for "off"."""
    return live_smoothing(table.smooth, table.smooth_hz, table.smooth_beta)
