"""Observations of this machine: sources, disk, ports, endpoints, certificates, input files."""

import os
import shutil
import socket
import ssl
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import zenocap
from zenocap.common.bus.security import Security
from zenocap.common.errors import AccessDenied, OpenError, SizeMismatch, SourceError, UserError
from zenocap.common.rig.rig import Viewer
from zenocap.common.rig.security import AUTHORITY, certificate_file, generations_in, host_of, key_file
from zenocap.common.rig.sources import Announced, BackgroundImage
from zenocap.common.runtime.clock import RealClock
from zenocap.tools.setup.doctor.machine_checks import Certificate, Disk, Endpoint, Port, SourceKind, SourceState

ROOT = Path(zenocap.__file__).resolve().parent
CALL_S = 2.0
FAULTS: tuple[tuple[type[SourceError], SourceKind], ...] = (
    (SizeMismatch, "size"),
    (AccessDenied, "denied"),
    (OpenError, "missing"),
    (SourceError, "broken"),
)  # what errors of a source are called; the first that fits


def look_at_source(viewer: Viewer, *, runs: bool, local: bool) -> SourceState:
    """Read one image of a viewer's source.  runs: its viewer runs and has opened it.  local: see `SourceState`."""
    from zenocap.services.viewer.sources.playback import Playback
    from zenocap.services.viewer.sources.source import open_source

    if runs:
        return SourceState(viewer.id, "used", "its viewer is running", local)
    if viewer.is_synthetic:
        return SourceState(viewer.id, "good", "the simulated person", local)
    if isinstance(viewer.source, Announced):
        words = f"on {viewer.source.machine}, where `zenocap viewer --discover` runs; `zenocap cameras --discover` lists it"
        return SourceState(viewer.id, "good", words, local)
    background = viewer.background
    if isinstance(background, BackgroundImage) and not background.path.is_file():
        return SourceState(viewer.id, "missing", f"no background picture {background.path}", local)
    frames = open_source(viewer, Playback(0, RealClock(), live=False))
    try:
        next(frames)
    except StopIteration:
        return SourceState(viewer.id, "broken", "delivers no image", local)
    except SourceError as error:
        kind = next(kind for fault, kind in FAULTS if isinstance(error, fault))
        return SourceState(viewer.id, kind, str(error), local)
    finally:
        close = getattr(frames, "close", None)
        if callable(close):
            close()
    width, height = viewer.calibrated_size
    return SourceState(viewer.id, "good", f"delivers images of the calibrated size, {width} x {height}", local)


def look_at_disk(folder: Path) -> Disk:
    """State of the disk of `folder`, which may not exist yet."""
    parent = folder
    while not parent.exists() and parent != parent.parent:
        parent = parent.parent
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        return Disk(folder, f"{parent} cannot be written to", None)
    try:
        return Disk(folder, None, shutil.disk_usage(parent).free)
    except OSError:
        return Disk(folder, None, None)


def look_at_file(path: Path) -> str | None:
    """Why a file cannot be read; None where it can."""
    try:
        path.read_bytes()
    except OSError as error:
        return f"{path}: {error.strerror}"
    return None


def look_at_port(title: str, key: str, host: str, port: int, *, ours: bool) -> Port:
    """State of a port.  ours: a service of this rig runs on this machine and may use it."""
    address = f"{host}:{port}"
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, place = found[0]
        with socket.socket(family, kind, protocol) as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            one.bind(place)
    except OSError as error:
        problem = error.strerror or str(error)
        return Port(title, key, address, problem, ours=ours and error.errno == 98)
    return Port(title, key, address)


def look_at_certificates(folder: Path, names: Sequence[str]) -> list[Certificate]:
    """Certificates of the authority and of these members."""
    return [_certificate(folder, name) for name in (AUTHORITY, *names)]


def certified(folder: Path) -> list[str]:
    """Names of the members whose certificates are on this machine."""
    secrets = sorted(folder.glob(key_file(Path(), "*").name)) if folder.is_dir() else []
    names = [path.name.removesuffix(key_file(Path(), "").name) for path in secrets]
    return [name for name in names if name != AUTHORITY]


def _certificate(folder: Path, name: str) -> Certificate:
    from zenocap.tools.setup.certificates import authority as ca

    path, secret, authority = certificate_file(folder, name), key_file(folder, name), certificate_file(folder, AUTHORITY)
    try:
        certificate = ca.read_certificate(str(path), path.read_bytes())
        if name == AUTHORITY:
            return Certificate(name, None, certificate.not_valid_after_utc)
        key = ca.read_key(str(secret), secret.read_bytes())
        issuer = ca.read_certificate(str(authority), authority.read_bytes())
        if not ca.belong_together(certificate, key):
            return Certificate(name, f"{secret} is not the key of {path}", None)
        if not ca.signed_by(certificate, issuer):
            return Certificate(name, f"{path} is not signed by {authority}", None)
        base, _, generation = ca.common_name(certificate).partition("@")
        if int(generation or 0) < generations_in(folder).get(base, 0):
            return Certificate(name, f"{path} is revoked", None)
    except OSError as error:
        return Certificate(name, f"{error.filename}: {error.strerror}", None)
    except (UserError, ValueError) as error:
        return Certificate(name, str(error), None)
    return Certificate(name, None, certificate.not_valid_after_utc, bool(secret.stat().st_mode & 0o077))


def probe_endpoint(address: str, security: Security | None) -> Endpoint:
    """Whether a Zenoh endpoint accepts connections and, with TLS, whether both certificates are accepted."""
    protocol, _, place = address.partition("/")
    port = place.rpartition(":")[2]
    if protocol not in ("tcp", "tls") or not port.isdecimal():
        return Endpoint(address)
    host = host_of(address)
    try:
        with socket.create_connection((host, int(port)), CALL_S) as plain:
            if protocol == "tls" and security is not None:
                _shake_hands(plain, host, security)
    except ssl.SSLCertVerificationError as error:
        return Endpoint(address, f"its certificate is not accepted: {error.verify_message}", trusted=False)
    except ssl.SSLError as error:
        return Endpoint(address, f"TLS fails: {(error.reason or str(error)).replace('_', ' ').lower()}", trusted=False)
    except OSError as error:
        return Endpoint(address, error.strerror or str(error) or "no answer")
    return Endpoint(address)


def _shake_hands(plain: socket.socket, host: str, security: Security) -> None:
    """TLS handshake with both certificates.  Raises ssl.SSLError and OSError."""
    context = ssl.create_default_context(cafile=_existing(security.authority))
    context.load_cert_chain(_existing(security.certificate), _existing(security.key))
    with context.wrap_socket(plain, server_hostname=host) as link:
        link.settimeout(0.3)
        with suppress(TimeoutError):
            link.recv(1)  # a rejection of our certificate arrives after the handshake


def _existing(path: Path) -> str:
    """Path of a file that exists.  Raises OSError, whose text names the file."""
    if not path.is_file():
        raise OSError(f"no file {path}")
    return str(path)
