"""The cameras of the machines that announce theirs."""

import time
from collections.abc import Iterator, Sequence

import msgspec

from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.messages import CameraHost

PATIENCE_S = 3.0  # for the machines to be found and to answer; chosen by hand
ANSWER_S = 1.0  # of each query, within that time; chosen by hand


def announced(session: FilmSession, patience_s: float = PATIENCE_S) -> list[CameraHost]:
    """Camera hosts that answer within `patience_s`, sorted by machine; all of it is waited, because others may come."""
    end_s, found = time.monotonic() + patience_s, dict[str, CameraHost]()
    while time.monotonic() < end_s:
        replies = session.hosts(ANSWER_S)
        found |= {key: reply for key, reply in replies.items() if isinstance(reply, CameraHost)}
        time.sleep(0.2)
    return sorted(found.values(), key=lambda host: host.machine)


def host_lines(hosts: Sequence[CameraHost]) -> Iterator[str]:
    """Lines on the cameras of other machines."""
    for host in hosts:
        machine = host.machine if host.machine == host.host else f"{host.machine} ({host.host})"
        for camera in host.cameras:
            name = f": {camera.name}" if camera.name not in ("", camera.id) else ""
            yield f"{machine}: {camera.id}{name}"
            note = "" if camera.stable or "://" in camera.source else "  # may change when plugged in again"
            yield f'  in a rig file: source = "{camera.source}"{note}'
            for mode in camera.modes:
                yield f"  {mode}"


def host_data(hosts: Sequence[CameraHost]) -> list[dict[str, object]]:
    """For JSON."""
    return [
        {"machine": host.machine, "host": host.host, **msgspec.to_builtins(camera)}
        for host in hosts
        for camera in host.cameras
    ]
