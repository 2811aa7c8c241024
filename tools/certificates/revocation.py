"""Revocation of certificates: the signed list, and its way to the routers of a rig."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.bus.access import ROUTER, Member
from zenocap.common.bus.revocations import Revocations, read_revocations
from zenocap.common.errors import UserError
from zenocap.common.rig.security import AUTHORITY, certificate_file, revocations_file
from zenocap.tools.certificates.folder import ready_authority


def revoke(folder: Path, rig: str, members: Sequence[Member], now: datetime) -> Revocations:
    """Write and return the folder's next list, in which these members have a new generation.

    Raises UserError, also where the authority's key is not in the folder.
    """
    for member in members:
        if member.service == ROUTER:
            raise UserError(
                "--revoke router: allowed: other members. Members check a router by authority and host name only: after "
                "the loss of its key create a new authority in an empty folder"
            )
    if not certificate_file(folder, AUTHORITY).exists():
        raise UserError(f"{certificate_file(folder, AUTHORITY)}: missing: run this where the authority was made")
    authority, _ = ready_authority(folder, rig, now)
    before = known(folder)
    generations = dict(before.generations)
    for member in members:
        name = member.common_name(rig)
        generations[name] = generations.get(name, 0) + 1
    unsigned = Revocations(before.number + 1, generations)
    signature = authority.key.sign(unsigned.signed_bytes(), ec.ECDSA(hashes.SHA256()))
    signed = Revocations(unsigned.number, generations, signature)
    write_atomically(revocations_file(folder), signed.encoded())
    return signed


def known(folder: Path) -> Revocations:
    """The folder's list; an empty one if there is none.  Raises BadRevocations."""
    path = revocations_file(folder)
    if not path.exists():
        return Revocations()
    return read_revocations(str(path), path.read_bytes(), certificate_file(folder, AUTHORITY).read_bytes())
