"""Folder of certificates: created once, kept, renewed or revoked on request."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.bus.access import ROUTER, Member
from zenocap.common.bus.certificate import WARNED_DAYS, days_left, valid_until
from zenocap.common.bus.revocations import Revocations, read_revocations
from zenocap.common.errors import UserError
from zenocap.common.rig.security import AUTHORITY, certificate_file, generations_in, key_file, revocations_file
from zenocap.tools.setup.certificates import authority as ca

SECRET = 0o600  # permissions of a private key
VALID_DAYS = 730  # of certificates by default; chosen by hand


@dataclass(frozen=True)
class MemberCertificate:
    """Result for one member's certificate.  hosts: names and addresses in it."""

    member: Member
    done: Literal["made", "kept", "renewed"]
    ends: datetime
    hosts: tuple[str, ...]


def ready_authority(folder: Path, rig: str, now: datetime) -> tuple[ca.Pair, bool]:
    """The folder's authority, and whether it was created now.  Raises UserError."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    certificate_path, key_path = certificate_file(folder, AUTHORITY), key_file(folder, AUTHORITY)
    if not certificate_path.exists() and not key_path.exists():
        pair = ca.new_authority(f"zenocap authority of {rig}"[:64], now)
        _write_pair(certificate_path, key_path, pair)
        return pair, True
    for path in (certificate_path, key_path):
        if not path.exists():
            raise UserError(
                f"{path}: missing beside the other half of the authority: run this where the authority was made, or in an "
                "empty folder, and give every machine new certificates"
            )
    pair = ca.Pair(
        ca.read_certificate(str(certificate_path), certificate_path.read_bytes()),
        ca.read_key(str(key_path), key_path.read_bytes()),
    )
    if not ca.belong_together(pair.certificate, pair.key):
        raise UserError(f"{key_path}: not the key of {certificate_path}")
    if pair.certificate.not_valid_after_utc <= now:
        raise UserError(
            f"{certificate_path}: expired on {pair.certificate.not_valid_after_utc:%Y-%m-%d}: "
            "delete the folder, run certs again"
        )
    return pair, False


def certify(
    folder: Path, rig: str, members: Mapping[Member, Sequence[str]], now: datetime, days: int, *, renew: bool = False,
    renew_within: timedelta | None = None,
) -> list[MemberCertificate]:  # fmt: skip
    """Create a certificate for each member and its hosts; existing ones are kept unless `renew`.

    renew_within: replaces those that expire within this time, for their hosts and those given.  Raises UserError, also for
    an existing one of another member, authority or host, and for a revoked one.
    """
    authority, _ = ready_authority(folder, rig, now)
    generations = generations_in(folder)
    made = []
    for member, hosts in members.items():
        path, secret = certificate_file(folder, member.name), key_file(folder, member.name)
        name = _common_name(member, rig, generations)
        exists = path.exists() or secret.exists()
        if exists and not renew:
            kept = _kept(path, member, name, hosts, authority)
            if renew_within is None or kept.ends - now > renew_within:
                made.append(kept)
                continue
            hosts = tuple(dict.fromkeys((*kept.hosts, *hosts)))
        pair = ca.issue(authority, name, hosts, now, days)
        _write_pair(path, secret, pair)
        done: Literal["made", "renewed"] = "renewed" if exists else "made"
        made.append(MemberCertificate(member, done, pair.certificate.not_valid_after_utc, ca.hosts_of(pair.certificate)))
    return made


def renewed(folder: Path, rig: str, members: Sequence[Member], now: datetime, days: int) -> list[MemberCertificate]:
    """Replace the certificates of these members that are in the folder, for the same hosts.  Raises UserError."""
    hosts = {}
    for member in members:
        path = certificate_file(folder, member.name)
        if path.exists():
            hosts[member] = ca.hosts_of(ca.read_certificate(str(path), path.read_bytes()))
    return certify(folder, rig, hosts, now, days, renew=True)


def renew_expiring(folder: Path, rig: str, members: Sequence[Member], now: datetime) -> list[MemberCertificate]:
    """Replace those certificates in the folder that expire within WARNED_DAYS; only where the authority's key is.

    Raises UserError and OSError.
    """
    if not key_file(folder, AUTHORITY).is_file():
        return []
    ends = {member: valid_until(certificate_file(folder, member.name)) for member in members}
    soon = [member for member, end in ends.items() if end is not None and days_left(end, now) <= WARNED_DAYS]
    return renewed(folder, rig, soon, now, VALID_DAYS) if soon else []


def _kept(path: Path, member: Member, name: str, hosts: Sequence[str], authority: ca.Pair) -> MemberCertificate:
    """name: common name that it should have."""
    if not path.exists():
        raise UserError(f"{path}: missing beside its key: --renew replaces both")
    certificate = ca.read_certificate(str(path), path.read_bytes())
    found = ca.hosts_of(certificate)
    if ca.common_name(certificate).partition("@")[0] == name.partition("@")[0] and ca.common_name(certificate) != name:
        raise UserError(f"{path}: is revoked: --renew replaces it")
    if ca.common_name(certificate) != name:
        raise UserError(f"{path}: exists already, of {ca.common_name(certificate)!r}: choose another folder, or --renew")
    if not ca.signed_by(certificate, authority.certificate):
        raise UserError(f"{path}: exists already, signed by another authority: --renew replaces it")
    missing = [host for host in hosts if ca.plain_host(host) not in found]
    if missing:
        raise UserError(f"{path}: exists already, but not for {', '.join(missing)}: --renew replaces it")
    return MemberCertificate(member, "kept", certificate.not_valid_after_utc, found)


def _common_name(member: Member, rig: str, generations: Mapping[str, int]) -> str:
    try:
        return member.common_name(rig, generations)
    except ValueError as error:
        raise UserError(str(error)) from error


def _write_pair(certificate: Path, secret: Path, pair: ca.Pair) -> None:
    """Write the key first: a certificate without its key would be kept by the next run."""
    write_atomically(secret, ca.key_pem(pair.key), SECRET)
    write_atomically(certificate, ca.pem(pair.certificate))


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
