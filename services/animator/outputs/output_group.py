"""All outputs of a rig: a failure of one is logged in one line and does not affect the others."""

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TypeAlias, cast

from zenocap.common.bus.protocol import Envelope
from zenocap.common.rig.animator import AnimatorTable, OutputTable
from zenocap.common.rig.outputs import OUTPUTS
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.table import attribute
from zenocap.services.animator.outputs.output import Output, OutputError
from zenocap.services.animator.states import ActorPose

logger = logging.getLogger(__name__)


Open: TypeAlias = Callable[[OutputTable, str, Clock], Output]


class OutputGroup:
    """The open outputs.  failed: one line of text for each that could not be opened."""

    def __init__(self, outputs: Sequence[Output], failed: Sequence[str] = ()) -> None:
        self.failed = tuple(failed)
        self._outputs = tuple(outputs)
        self._errors = Counter[str]()
        self._log_once = OncePerSource(logger)

    def receive(self, envelope: Envelope) -> None:
        """Pass a message of the rig to all outputs."""
        for output in self._outputs:
            with self._errors_counted(output):
                output.receive(envelope)

    def send(self, actor: ActorPose, posture: str | None) -> None:
        """Pass a pose to all outputs.  posture: the recognized one, None for none."""
        for output in self._outputs:
            with self._errors_counted(output):
                output.send(actor, posture)

    def counts(self) -> Mapping[str, int]:
        """Return the counters of all outputs for the health, such as `vmc_sent`."""
        found: dict[str, int] = {}
        for output in self._outputs:
            name = output.title.split()[0].removeprefix("animator.")
            counts = Counter(output.counts()) + Counter(errors=self._errors[output.title])
            found |= {f"{name}_{kind}": count for kind, count in counts.items()}
        return found

    def close(self) -> None:
        for output in self._outputs:
            with self._errors_counted(output):
                output.close()

    @contextmanager
    def _errors_counted(self, output: Output) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # a fault of one output must not affect the others
            self._errors[output.title] += 1
            self._log_once.warn(output.title, type(error).__name__, f"{type(error).__name__}: {error}", trace=True)


def open_outputs(table: AnimatorTable, rig: str, clock: Clock) -> OutputGroup:
    """Open the enabled outputs of the table; those that fail are logged and listed.  rig: its name."""
    opened: list[Output] = []
    failed: list[str] = []
    for name, output_table in _enabled(table).items():
        try:
            output = cast("Open", attribute(OUTPUTS.row(name).open))(output_table, rig, clock)
        except OutputError as error:
            logger.error("%s; the other outputs are not affected", error)
            failed.append(str(error))
        else:
            logger.info("%s: sending", output.title)
            opened.append(output)
    return OutputGroup(opened, failed)


def has_outputs(table: AnimatorTable) -> bool:
    return bool(_enabled(table))


def _enabled(table: AnimatorTable) -> dict[str, OutputTable]:
    return {name: one for name, one in table.outputs.items() if one.enabled}
