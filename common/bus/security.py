"""Zenoh's settings for a secured network: nothing but TLS, certificates on both sides, and rules by their names."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from common.bus.protocol import BusError

ROUTER_PORT = 7447


@dataclass(frozen=True)
class Security:
    """Certificates of both sides of every link (mTLS).  authority, certificate, key: PEM files.

    access: of `common.bus.access`, for routers and peers; None for one who can only be a client.
    """

    authority: Path
    certificate: Path
    key: Path
    access: str | None = None


def secured(security: Security, mode: str, connect: Sequence[str], listen: Sequence[str]) -> Mapping[str, str]:
    """What to set, by Zenoh's key, as JSON.  mode: peer, client or router.  connect, listen: what else is set.

    Raises BusError for an endpoint that is not TLS, a file that cannot be read, or a mode that rules are missing for.
    """
    for key, endpoints in (("connect", connect), ("listen", listen)):
        for endpoint in endpoints:
            if not endpoint.startswith("tls/"):
                raise BusError(f"{key} = {endpoint!r}: allowed with a rig's [security]: tls/HOST:PORT")
    for file in (security.authority, security.certificate, security.key):
        try:
            file.read_bytes()
        except PermissionError as error:
            raise BusError(f"{file}: cannot be read: let the user who runs this own it") from error
        except OSError as error:
            raise BusError(f"{file}: {error.strerror}: `zenocap certs` makes it; copy it here") from error
    settings = {"transport/link/protocols": '["tls"]'} | {
        f"transport/link/tls/{key}": json.dumps(value) for key, value in _tls(security).items()
    }
    if mode == "client":  # has one link, to a router or peer whose name was checked, and which keeps the rules
        return settings
    if security.access is None:
        raise BusError(f"mode = {mode!r}: allowed with certificates alone, without a rig: 'client'")
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
