"""A take that is written with the verdict on its messages as the last one."""

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.closable import Closable
from zenocap.common.messages import Verdict
from zenocap.common.recording.writer import Recording
from zenocap.common.topics import VERDICT
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.verdict import verdict_of


class TakeWriter(Closable):
    """Writes to a recording, which is closed on leaving the context.  rig: its name."""

    def __init__(self, recording: Recording, rig: str) -> None:
        self.recording, self._rig = recording, rig
        self._evidence = TakeEvidence()

    def record(self, received: Envelope, *, converted: bool = True) -> None:
        """Write a message.  converted: whether it is shown on the channels for other programs, too."""
        self._evidence.add(received.message)
        self.recording.record(received, converted=converted)

    def judge(self, now_ns: int) -> Verdict:
        """Write the verdict, as the last message; now_ns: its log time."""
        verdict = verdict_of(self._evidence)
        self.recording.record(Envelope(VERDICT.at(self._rig), VERDICT, verdict, now_ns, codec.encode(verdict)))
        return verdict

    def close(self) -> None:
        self.recording.close()
