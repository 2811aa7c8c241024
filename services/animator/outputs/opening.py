"""The outputs that a rig asks for, all together: one that fails is told in one line, and the others go on."""

import logging
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from common.bus.protocol import Envelope
from common.runtime.animator_table import AnimatorTable, FoxgloveTable, LslTable, UdpTable, VmcTable
from common.runtime.clock import Clock
from common.runtime.logs import OncePerSource
from services.animator.outputs.output import Output, OutputError
from services.animator.snapshot import Actor

logger = logging.getLogger(__name__)


class Outputs:
    """failed: what could not be opened, a line each, for the person."""

    def __init__(self, outputs: Sequence[Output], failed: Sequence[str] = ()) -> None:
        self.failed = tuple(failed)
        self._outputs = tuple(outputs)
        self._errors = Counter[str]()
        self._once = OncePerSource(logger)

    @property
    def titles(self) -> tuple[str, ...]:
        """Of those that are open."""
        return tuple(output.title for output in self._outputs)

    def hear(self, envelope: Envelope) -> None:
        """A message of the rig, to all."""
        for output in self._outputs:
            with self._told(output):
                output.hear(envelope)

    def send(self, actor: Actor, posture: str | None) -> None:
        """A pose, to all.  posture: recognised in it, None while there is none."""
        for output in self._outputs:
            with self._told(output):
                output.send(actor, posture)

    def counts(self) -> Mapping[str, int]:
        """By output and what it counts, such as `vmc_sent`, for the animator's health."""
        found: dict[str, int] = {}
        for output in self._outputs:
            name = output.title.split()[0].removeprefix("animator.")
            counts = Counter(output.counts()) + Counter(errors=self._errors[output.title])
            found |= {f"{name}_{what}": count for what, count in counts.items()}
        return found

    def close(self) -> None:
        for output in self._outputs:
            with self._told(output):
                output.close()

    @contextmanager
    def _told(self, output: Output) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # whatever is wrong with one must not end what the others get
            self._errors[output.title] += 1
            self._once.warn(output.title, type(error).__name__, f"{type(error).__name__}: {error}", trace=True)


def open_outputs(table: AnimatorTable, rig: str, clock: Clock) -> Outputs:
    """Those that the table has and that can be opened; the others are logged and listed as failed.  rig: its name."""
    opened: list[Output] = []
    failed: list[str] = []
    for wanted in (table.vmc, table.udp, table.foxglove, table.lsl):
        if wanted is None or not wanted.enabled:
            continue
        try:
            output = _opened(wanted, rig, clock)
        except OutputError as error:
            logger.error("%s; the rest goes on without it", error)
            failed.append(str(error))
        else:
            logger.info("%s: sending", output.title)
            opened.append(output)
    return Outputs(opened, failed)


def _opened(table: VmcTable | UdpTable | FoxgloveTable | LslTable, rig: str, clock: Clock) -> Output:
    """Raises OutputError.  What an output needs is loaded only where it is wanted."""
    match table:
        case VmcTable():
            from services.animator.outputs.vmc import VmcOutput

            return VmcOutput(table)
        case UdpTable():
            from services.animator.outputs.udp import UdpOutput

            return UdpOutput(table, rig)
        case FoxgloveTable():
            from services.animator.outputs.foxglove import FoxgloveOutput

            return FoxgloveOutput(table, rig)
        case LslTable():
            from services.animator.outputs.lsl import LslOutput

            return LslOutput(table, rig, clock)
