"""The `[security]` table of a rig: every link encrypted, a certificate on both sides, and who may say what by its name."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
from msgspec import Meta

from common.bus.access import READER, RECORDER, REPLAY, ROUTER, Member, access_control
from common.bus.security import Security

if TYPE_CHECKING:
    from common.runtime.rig import Rig

AUTHORITY = "authority"
SERVICES = ("integrator", "tracker", "recognizer", "animator")


class SecurityTable(msgspec.Struct, frozen=True, kw_only=True):
    """certificates: the folder, relative to the rig file, of what `zenocap certs` makes; each machine has its own."""

    certificates: Annotated[str, Meta(min_length=1)] = "certs"


def certificate_file(folder: Path, name: str) -> Path:
    """Of a member, or of the AUTHORITY, which all others have too."""
    return folder / f"{name}.pem"


def key_file(folder: Path, name: str) -> Path:
    """The secret beside it."""
    return folder / f"{name}-key.pem"


def host_of(endpoint: str) -> str:
    """Of an endpoint such as tls/192.168.1.10:7447 or tls/[fe80::1]:7447."""
    return endpoint.partition("/")[2].rpartition(":")[0].strip("[]")


def allowed_members(rig: "Rig") -> tuple[Member, ...]:
    """Whom the rules of a rig know, whether they have a certificate or not; routers left out."""
    viewers = (Member("viewer", viewer.id) for viewer in rig.viewers)
    return (*viewers, *(Member(name) for name in (*SERVICES, READER, RECORDER, REPLAY)))


def needed_members(rig: "Rig") -> tuple[Member, ...]:
    """Who gets a certificate without being asked for: what the rig runs, and who reads, records and routes."""
    optional = {"tracker": rig.tracker is not None, "recognizer": rig.recognizer is not None}
    there = [member for member in allowed_members(rig) if optional.get(member.service, member.service != REPLAY)]
    return (*there, Member(ROUTER))


def security_in(folder: Path, name: str) -> Security:
    """How `name` takes part as a client, by the certificates of a folder alone."""
    return Security(certificate_file(folder, AUTHORITY), certificate_file(folder, name), key_file(folder, name), None)


def security_of(rigs: Sequence["Rig"], name: str) -> Security | None:
    """How `name`, such as viewer-1, takes part in the rigs; None where they are not secured.

    Raises ValueError for rigs of which only some are, or whose certificates are of different folders.
    """
    folders = {rig.name: None if rig.security is None else rig.security.resolve() for rig in rigs}
    if len(set(folders.values())) > 1:
        words = ", ".join(f"{rig}: {folder or 'none'}" for rig, folder in folders.items())
        raise ValueError(f"security.certificates differ ({words}): allowed together: rigs of one folder of certificates")
    folder = next(iter(folders.values()), None)
    if folder is None:
        return None
    return replace(security_in(folder, name), access=access_control({rig.name: allowed_members(rig) for rig in rigs}))
