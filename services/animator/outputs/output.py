"""What an output is: it is handed every pose, sends it on as well as it can, and never waits."""

from collections.abc import Mapping
from typing import Protocol

from common.bus.protocol import Envelope
from services.animator.snapshot import Actor


class OutputError(Exception):
    """An output that cannot be opened; the text names its key in the rig, the value, and what is wrong with it."""


class Output(Protocol):
    """All is called from one thread.  Nothing here waits for a receiver, and nothing raises once it is open."""

    @property
    def title(self) -> str:
        """Its key in the rig, and where it sends: such as "animator.vmc 127.0.0.1:39539"."""
        ...

    def hear(self, envelope: Envelope) -> None:
        """A message of the rig, before the actor that follows from it is sent."""
        ...

    def send(self, actor: Actor, posture: str | None) -> None:
        """A new pose, or that the person is lost.  posture: recognised in it, None while there is none."""
        ...

    def counts(self) -> Mapping[str, int]:
        """What was sent and what was not, since it was opened."""
        ...

    def close(self) -> None: ...
