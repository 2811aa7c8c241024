"""The cameras of the machines that announce theirs."""

import time
from collections.abc import Iterator, Sequence

import msgspec

from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.messages import CameraHost
from zenocap.common.rig.sources import Announced
from zenocap.common.runtime.foreign_text import printable

PATIENCE_S = 3.0  # for the machines to be found and to answer; chosen by hand
ANSWER_S = 1.0  # of each query, within that time; chosen by hand


def announced(session: FilmSession) -> list[CameraHost]:
    """Camera hosts that answer within PATIENCE_S, sorted by machine; all of it is waited, because others may come."""
    end_s, found = time.monotonic() + PATIENCE_S, dict[tuple[str, str], CameraHost]()
    while time.monotonic() < end_s:
        replies = session.hosts(ANSWER_S)
        found |= {(one.machine, one.instance): one for one in replies if isinstance(one, CameraHost)}
        time.sleep(0.2)
    return [found[key] for key in sorted(found)]


def host_lines(hosts: Sequence[CameraHost]) -> Iterator[str]:
    """Lines on the cameras of other machines, and on two machines of one name."""
    for host in hosts:
        machine = host.machine if host.machine == host.host else f"{host.machine} ({host.host})"
        for camera in host.cameras:
            name = f": {camera.name}" if camera.name not in ("", camera.id) else ""
            yield f"{machine}: {camera.id}{name}"
            note = "" if camera.stable or "://" in camera.source else "  # may change when plugged in again"
            yield f'  in a rig file: source = "discover:{host.machine}/{camera.id}"'
            yield f"  there: {camera.source}{note}"
            if camera.used_by:
                yield f"  in use: {camera.used_by}"
            for mode in camera.modes:
                yield f"  {mode}"
    for name in sorted({host.machine for host in hosts}):
        own = [host.host for host in hosts if host.machine == name]
        if len(own) > 1:
            yield f"note: {len(own)} machines announce as {name}: {', '.join(own)}: give all but one another --machine"


def host_problem(source: Announced, hosts: Sequence[CameraHost]) -> str:
    """Reason that a camera is not found among the camera hosts, and the remedy; empty where it is."""
    own = [one for one in hosts if one.machine == source.machine]
    if not own:
        there = ", ".join(sorted({printable(one.machine) for one in hosts})) or "none"
        return (
            f"no machine {source.machine} announces its cameras (there are: {there}): run there: zenocap viewer "
            f"--discover --machine {source.machine}"
        )
    if len({one.instance for one in own}) > 1:
        names = " and ".join(sorted(printable(one.host) for one in own))
        return f"two machines announce as {source.machine}: {names}: run one of them with another --machine"
    cameras = [one.id for one in own[0].cameras]
    if source.camera not in cameras:
        there = ", ".join(map(printable, cameras)) or "none"
        return (
            f"{source.machine} has no camera {source.camera} (there are: {there}): plug it in, or run there: zenocap "
            f"viewer --discover --camera {source.camera}=SOURCE"
        )
    return ""


def host_data(hosts: Sequence[CameraHost]) -> list[dict[str, object]]:
    return [
        {"machine": host.machine, "host": host.host, **msgspec.to_builtins(camera)}
        for host in hosts
        for camera in host.cameras
    ]
