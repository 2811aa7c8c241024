"""The folder of certificates: created once, kept, renewed on request; keys are readable only by the owner."""

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from zenocap.common.bus.access import Member
from zenocap.common.errors import UserError
from zenocap.common.rig.security import AUTHORITY, certificate_file, key_file
from zenocap.tools.certificates.authority import (
    Pair,
    belong_together,
    common_name,
    hosts_of,
    issue,
    key_pem,
    new_authority,
    pem,
    plain_host,
    read_certificate,
    read_key,
    signed_by,
)

SECRET, OPEN = 0o600, 0o644


@dataclass(frozen=True)
class MemberCertificate:
    """Result for one member's certificate.  hosts: names and addresses in it."""

    member: Member
    done: Literal["made", "kept", "renewed"]
    ends: datetime
    hosts: tuple[str, ...]


def ready_authority(folder: Path, rig: str, now: datetime) -> tuple[Pair, bool]:
    """The folder's authority, and whether it was created now.  Raises UserError."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    certificate_path, key_path = certificate_file(folder, AUTHORITY), key_file(folder, AUTHORITY)
    if not certificate_path.exists() and not key_path.exists():
        pair = new_authority(f"zenocap authority of {rig}"[:64], now)
        _write_pair(certificate_path, key_path, pair)
        return pair, True
    for path in (certificate_path, key_path):
        if not path.exists():
            raise UserError(
                f"{path}: missing beside the other half of the authority: run this where the authority was made, or in an "
                "empty folder, and give every machine new certificates"
            )
    pair = Pair(
        read_certificate(str(certificate_path), certificate_path.read_bytes()),
        read_key(str(key_path), key_path.read_bytes()),
    )
    if not belong_together(pair.certificate, pair.key):
        raise UserError(f"{key_path}: not the key of {certificate_path}")
    if pair.certificate.not_valid_after_utc <= now:
        raise UserError(
            f"{certificate_path}: expired on {pair.certificate.not_valid_after_utc:%Y-%m-%d}: "
            "delete the folder, run certs again"
        )
    return pair, False


def certify(
    folder: Path, rig: str, members: Mapping[Member, Sequence[str]], now: datetime, days: int, *, renew: bool = False
) -> list[MemberCertificate]:
    """Create a certificate for each member and its hosts; existing ones are kept unless `renew`.

    Raises UserError, also for an existing one of another member, authority or host.
    """
    authority, _ = ready_authority(folder, rig, now)
    made = []
    for member, hosts in members.items():
        path, secret = certificate_file(folder, member.name), key_file(folder, member.name)
        exists = path.exists() or secret.exists()
        if exists and not renew:
            made.append(_kept(path, member, rig, hosts, authority))
            continue
        pair = issue(authority, _common_name(member, rig), hosts, now, days)
        _write_pair(path, secret, pair)
        done: Literal["made", "renewed"] = "renewed" if exists else "made"
        made.append(MemberCertificate(member, done, pair.certificate.not_valid_after_utc, hosts_of(pair.certificate)))
    return made


def _kept(path: Path, member: Member, rig: str, hosts: Sequence[str], authority: Pair) -> MemberCertificate:
    if not path.exists():
        raise UserError(f"{path}: missing beside its key: --renew replaces both")
    certificate = read_certificate(str(path), path.read_bytes())
    found = hosts_of(certificate)
    if common_name(certificate) != _common_name(member, rig):
        raise UserError(f"{path}: exists already, of {common_name(certificate)!r}: choose another folder, or --renew")
    if not signed_by(certificate, authority.certificate):
        raise UserError(f"{path}: exists already, signed by another authority: --renew replaces it")
    missing = [host for host in hosts if plain_host(host) not in found]
    if missing:
        raise UserError(f"{path}: exists already, but not for {', '.join(missing)}: --renew replaces it")
    return MemberCertificate(member, "kept", certificate.not_valid_after_utc, found)


def _common_name(member: Member, rig: str) -> str:
    try:
        return member.common_name(rig)
    except ValueError as error:
        raise UserError(str(error)) from error


def _write_pair(certificate: Path, secret: Path, pair: Pair) -> None:
    """Write the key first: a certificate without its key would be kept by the next run."""
    _write(secret, key_pem(pair.key), SECRET)
    _write(certificate, pem(pair.certificate), OPEN)


def _write(path: Path, content: bytes, mode: int) -> None:
    """Write a file atomically, with permissions never wider than `mode`."""
    handle, name = tempfile.mkstemp(dir=path.parent)  # permissions 0600
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, mode)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
