"""What a service says of itself to whoever asks."""

import socket

from common.about import About
from common.runtime.rig import Rig
from common.runtime.versions import versions


def about(rig: Rig, service: str, id: str, now_ns: int) -> About:
    """Of a service on this machine."""
    return About(
        frame=0,
        captured_ns=now_ns,
        service=service,
        id=id,
        host=socket.gethostname()[:1000],
        digest=rig.digest,
        versions={name: text[:1000] for name, text in versions().items()},
    )
