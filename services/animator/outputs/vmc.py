"""Virtual Motion Capture protocol (protocol.vmc.info): the actor drives avatars in programs that show them.

We are its "performer", the receiver is its "marionette".  The model's root stays in the world's origin, on the ground;
the hips have their place in it.  Each pose is one bundle or two, none larger than a network's packet.
"""

from collections.abc import Mapping

import numpy as np

from common.bus.protocol import Envelope
from common.runtime.animator_table import VmcTable
from services.animator.outputs import osc
from services.animator.outputs.datagrams import Datagrams
from services.animator.outputs.humanoid import Humanoid
from services.animator.snapshot import Actor

PACKET = 1400  # bytes of a datagram that networks do not divide
LOADED, CALIBRATED, NORMAL = 1, 3, 0
ROOT = osc.message("/VMC/Ext/Root/Pos", "root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
BONE = osc.text("/VMC/Ext/Bone/Pos") + osc.text(",sfffffff")
NOT_LOADED = osc.message("/VMC/Ext/OK", 0, 0, 0, 0)


class VmcOutput:
    """Sends every pose; while the person is lost, only that there is no tracking, so that avatars stay as they are."""

    def __init__(self, table: VmcTable) -> None:
        """Raises OutputError."""
        self._to = Datagrams("animator.vmc", table.host, table.port)
        self._humanoid: Humanoid | None = None
        self._body: object = None
        self._heads: list[bytes] = []
        self._start_ns: int | None = None

    @property
    def title(self) -> str:
        return self._to.title

    def hear(self, envelope: Envelope) -> None:
        pass

    def send(self, actor: Actor, posture: str | None) -> None:
        if self._humanoid is None or self._body is not actor.body:
            self._humanoid, self._body = Humanoid(actor.anatomy, actor.body), actor.body
            self._heads = [BONE + osc.text(name) for name in self._humanoid.names]
        if self._start_ns is None:
            self._start_ns = actor.captured_ns
        lost = "person" in actor.lost
        since = osc.message("/VMC/Ext/T", (actor.captured_ns - self._start_ns) / 1e9)
        messages = [osc.message("/VMC/Ext/OK", LOADED, CALIBRATED, NORMAL, int(not lost)), since]
        if not lost:
            numbers = self._humanoid.bones(actor.pose).astype(np.dtype(">f4"))
            messages.append(ROOT)
            messages += [head + row.tobytes() for head, row in zip(self._heads, numbers, strict=True)]
        for bundle in osc.bundles(messages, PACKET):
            self._to.send(bundle)

    def counts(self) -> Mapping[str, int]:
        return self._to.counts

    def close(self) -> None:
        """Tells the receiver that no more comes."""
        self._to.send(NOT_LOADED)
        self._to.close()
