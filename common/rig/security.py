"""Security of a rig: certificates of its members, and the access rules derived from them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from zenocap.common.bus.access import OPERATOR, READER, RECORDER, REPLAY, ROUTER, Member, access_control
from zenocap.common.bus.revocations import NO_GENERATIONS, read_revocations
from zenocap.common.bus.security import RouterFiles, Security
from zenocap.common.rig.commands import ZenohAction
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import OF_RIGS, services_of

AUTHORITY = "authority"


def certificate_file(folder: Path, name: str) -> Path:
    """Certificate of a member, or of the AUTHORITY, which every machine has."""
    return folder / f"{name}.pem"


def key_file(folder: Path, name: str) -> Path:
    """Private key of a member."""
    return folder / f"{name}-key.pem"


def revocations_file(folder: Path) -> Path:
    """List of the revoked certificates."""
    return folder / "revoked.json"


def host_of(endpoint: str) -> str:
    """Host of an endpoint such as tls/192.168.1.10:7447 or tls/[fe80::1]:7447."""
    return endpoint.partition("/")[2].rpartition(":")[0].strip("[]")


def allowed_members(rig: Rig) -> tuple[Member, ...]:
    """Members that the access rules of a rig name, with or without a certificate; routers excepted."""
    viewers = (Member("viewer", viewer.id) for viewer in rig.viewers)
    commands = rig.recognizer.commands if rig.recognizer is not None else ()
    puts = tuple(one.action.key for one in commands if isinstance(one.action, ZenohAction))
    names = (name for name in OF_RIGS if name != "viewer")
    others = (Member(name, puts=puts if name == "recognizer" else ()) for name in names)
    return (*viewers, *others, *map(Member, (READER, RECORDER, REPLAY, OPERATOR)))


def needed_members(rig: Rig) -> tuple[Member, ...]:
    """Members that get a certificate by default: the services that the rig runs, readers, the recorder and routers."""
    services = (Member(name, id) for name, id in services_of(rig))
    return (*services, *map(Member, (READER, RECORDER, ROUTER)))


def security_in(folder: Path, name: str) -> Security:
    """Security of member `name` as a client, from a folder of certificates."""
    return Security(certificate_file(folder, AUTHORITY), certificate_file(folder, name), key_file(folder, name), None)


def security_of(rigs: Sequence[Rig], name: str, generations: Mapping[str, int] | None = None) -> Security | None:
    """Security of member `name`, such as viewer-1, in the rigs; None when they are not secured.

    generations: of the revoked members, see `Revocations`; None for those of the list in the folder.

    Raises ValueError when only some of the rigs are secured, or when their folders of certificates differ.
    """
    folders = {rig.name: None if rig.security is None else rig.security.resolve() for rig in rigs}
    if len(set(folders.values())) > 1:
        folders_text = ", ".join(f"{rig}: {folder or 'none'}" for rig, folder in folders.items())
        raise ValueError(
            f"security.certificates differ ({folders_text}): allowed together: rigs of one folder of certificates"
        )
    folder = next(iter(folders.values()), None)
    if folder is None:
        return None
    if generations is None:
        generations = generations_in(folder)
    members = {rig.name: allowed_members(rig) for rig in rigs}
    return replace(security_in(folder, name), access=access_control(members, generations))


def generations_in(folder: Path) -> Mapping[str, int]:
    """Generations of the revoked members by the list in a folder of certificates; empty without one.

    Raises BadRevocations, ModuleNotFoundError without the package cryptography.
    """
    path = revocations_file(folder)
    if not path.is_file():
        return NO_GENERATIONS
    return read_revocations(str(path), path.read_bytes(), certificate_file(folder, AUTHORITY).read_bytes()).generations


def router_files(rigs: Sequence[Rig]) -> RouterFiles | None:
    """Files of a router for these rigs; None when they are not secured."""
    folder = next((rig.security for rig in rigs if rig.security is not None), None)
    if folder is None:
        return None
    authority, own = (certificate_file(folder, name) for name in (AUTHORITY, ROUTER))
    revoked = revocations_file(folder)
    watched = (authority, revoked, own, key_file(folder, ROUTER))
    return RouterFiles(tuple(rig.name for rig in rigs), authority, own, revoked, watched)
