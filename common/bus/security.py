"""Zenoh's settings for a secured network: mutual TLS, access rules by common name."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from zenocap.common.bus.certificate import valid_until
from zenocap.common.bus.protocol import BusError

ROUTER_PORT = 7447


@dataclass(frozen=True)
class Security:
    """Certificates of both sides of every link (mTLS).  authority, certificate, key: PEM files.

    access: rules from `zenocap.common.bus.access`, for routers and peers; None for a member that can only be a client.
    """

    authority: Path
    certificate: Path
    key: Path
    access: str | None = None


@dataclass(frozen=True)
class RouterFiles:
    """Files of a secured router.  rigs: names.  authority, certificate: those of the authority and of the router.

    revoked: list of revocations, may be missing.  watched: files whose change opens the session again.
    """

    rigs: Sequence[str]
    authority: Path
    certificate: Path
    revoked: Path
    watched: Sequence[Path]


def secured(security: Security, mode: str, connect: Sequence[str], listen: Sequence[str]) -> Mapping[str, str]:
    """Settings by Zenoh's key, as JSON.  mode: peer, client or router.  connect, listen: the configured endpoints.

    Raises BusError for an endpoint that is not TLS, a file that cannot be read, an expired certificate, or a mode whose
    access rules are missing.
    """
    for key, endpoints in (("connect", connect), ("listen", listen)):
        for endpoint in endpoints:
            if not endpoint.startswith("tls/"):
                raise BusError(f"{key} = {endpoint!r}: allowed with a rig's [security]: tls/HOST:PORT")
    for file in (security.authority, security.certificate, security.key):
        try:
            file.read_bytes()
        except PermissionError as error:
            raise BusError(f"{file}: cannot be read: its owner must be the user who runs this process") from error
        except OSError as error:
            raise BusError(
                f"{file}: {error.strerror}: create it with `zenocap certs` and copy it to this machine"
            ) from error
    now = datetime.now(UTC)
    for file in (security.authority, security.certificate):
        ends = valid_until(file)
        if ends is not None and ends <= now:
            raise BusError(
                f"{file}: expired on {ends:%Y-%m-%d}: renew it with `zenocap certs RIG --renew` where the authority is, "
                "and copy it to this machine"
            )
    settings = {"transport/link/protocols": '["tls"]'} | {
        f"transport/link/tls/{key}": json.dumps(value) for key, value in _tls(security).items()
    }
    if mode == "client":  # has one link, to an authenticated router or peer that applies the rules
        return settings
    if security.access is None:
        raise BusError(f"mode = {mode!r}: allowed with certificates only, without a rig: 'client'")
    settings["access_control"] = security.access
    if not listen:
        settings["listen/endpoints"] = f'["tls/[::]:{ROUTER_PORT if mode == "router" else 0}"]'
    return settings


def _tls(security: Security) -> dict[str, str | bool]:
    certificate, key = str(security.certificate.resolve()), str(security.key.resolve())
    return {
        "root_ca_certificate": str(security.authority.resolve()),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }
