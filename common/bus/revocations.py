"""The list of revoked certificates: signed by the rig's authority, so that any machine may pass it on.

Zenoh identifies members by the common names of certificates, without a list of revoked serial numbers.  So every member
has a generation, 0 at first, which is a part of the common name.  A revocation raises the generation of a member; the
access rules admit the present one only, and certificates made from then on have it.
"""

import json
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import Annotated

import msgspec
from msgspec import Meta

from zenocap.common.errors import UserError

MAX_BYTES = 1 << 20
MAX_MEMBERS = 10_000
NO_GENERATIONS: Mapping[str, int] = MappingProxyType({})

_Count = Annotated[int, Meta(ge=1, le=2**31)]
_Names = Annotated[dict[Annotated[str, Meta(max_length=64)], _Count], Meta(max_length=MAX_MEMBERS)]


class _File(msgspec.Struct, forbid_unknown_fields=True):
    number: _Count
    generations: _Names
    signature: Annotated[str, Meta(max_length=256)]


@dataclass(frozen=True)
class Revocations:
    """number: of the list; a later one is higher, 0 for none yet.  generations: by common name of generation 0."""

    number: int = 0
    generations: Mapping[str, int] = field(default_factory=lambda: NO_GENERATIONS)
    signature: bytes = b""

    def signed_bytes(self) -> bytes:
        """Content that the authority signs."""
        content = {"zenocap": "revocations", "number": self.number, "generations": dict(self.generations)}
        return json.dumps(content, sort_keys=True, separators=(",", ":")).encode()

    def encoded(self) -> bytes:
        content = {"number": self.number, "generations": dict(sorted(self.generations.items()))}
        return json.dumps(content | {"signature": b64encode(self.signature).decode()}, indent=1).encode() + b"\n"


class BadRevocations(UserError):
    """A list that cannot be read, or that the authority has not signed."""


def read_revocations(name: str, data: bytes, authority: bytes) -> Revocations:
    """A list whose signature is verified.  name: of the file or key, for errors.  authority: its certificate, PEM.

    Raises BadRevocations, ModuleNotFoundError without the package cryptography.
    """
    try:
        if len(data) > MAX_BYTES:
            raise ValueError(f"{len(data)} bytes, more than {MAX_BYTES}")
        content = msgspec.json.decode(data, type=_File)
        found = Revocations(content.number, content.generations, b64decode(content.signature, validate=True))
    except (ValueError, RecursionError) as error:
        raise BadRevocations(f"{name}: no list of revocations: {error}") from error
    _verify(name, found, authority)
    return found


def _verify(name: str, found: Revocations, authority: bytes) -> None:
    ec = import_module("cryptography.hazmat.primitives.asymmetric.ec")
    hashes = import_module("cryptography.hazmat.primitives.hashes")
    x509 = import_module("cryptography.x509")
    exceptions = import_module("cryptography.exceptions")
    try:
        key = x509.load_pem_x509_certificate(authority).public_key()
        key.verify(found.signature, found.signed_bytes(), ec.ECDSA(hashes.SHA256()))
    except (ValueError, TypeError, AttributeError, exceptions.InvalidSignature, exceptions.UnsupportedAlgorithm) as error:
        raise BadRevocations(f"{name}: not signed by the authority of this rig") from error
