"""Looks at this machine: sources, disk, ports, certificates, what is compiled, and the files of tracker and recogniser."""

import os
import shutil
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

from common.runtime.clock import RealClock
from common.runtime.rig import Rig, Viewer
from common.runtime.security import AUTHORITY, certificate_file, key_file
from common.runtime.specs import Actor, BackgroundImage
from services.doctor.machine_checks import Certificate, Disk, File, Port, SourceLook

ROOT = Path(__file__).resolve().parents[2]


def look_at_source(viewer: Viewer, *, runs: bool, local: bool) -> SourceLook:
    """One image of a viewer's source.  runs: its viewer does, and has it.  local: see `SourceLook`."""
    from services.viewer.source import open_source
    from services.viewer.sources.frame import AccessDenied, OpenError, Playback, SizeMismatch, SourceError

    if runs:
        return SourceLook(viewer.id, "used", "its viewer is running", local)
    if isinstance(viewer.source, Actor):
        return SourceLook(viewer.id, "good", "the synthetic actor", local)
    background = viewer.background
    if isinstance(background, BackgroundImage) and not background.path.is_file():
        return SourceLook(viewer.id, "missing", f"no background picture {background.path}", local)
    frames = open_source(viewer, Playback(0, RealClock(), live=False))
    try:
        next(frames)
    except StopIteration:
        return SourceLook(viewer.id, "broken", "has no image", local)
    except SizeMismatch as error:
        return SourceLook(viewer.id, "size", str(error), local)
    except AccessDenied as error:
        return SourceLook(viewer.id, "denied", str(error), local)
    except OpenError as error:
        return SourceLook(viewer.id, "missing", str(error), local)
    except SourceError as error:
        return SourceLook(viewer.id, "broken", str(error), local)
    finally:
        close = getattr(frames, "close", None)
        if callable(close):
            close()
    width, height = viewer.calibrated_size
    return SourceLook(viewer.id, "good", f"gives images of the calibrated size, {width} x {height}", local)


def look_at_disk(folder: Path) -> Disk:
    """Of a folder that may have to be made first."""
    there = folder
    while not there.exists() and there != there.parent:
        there = there.parent
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        return Disk(folder, f"{there} cannot be written to", None)
    try:
        return Disk(folder, None, shutil.disk_usage(there).free)
    except OSError:
        return Disk(folder, None, None)


def look_at_port(what: str, key: str, host: str, port: int, *, ours: bool) -> Port:
    """ours: a service of this rig runs on this machine, and may have it."""
    address = f"{host}:{port}"
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[
            0
        ]
        with socket.socket(family, kind, protocol) as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            one.bind(place)
    except OSError as error:
        problem = error.strerror or str(error)
        return Port(what, key, address, problem, ours=ours and error.errno == 98)
    return Port(what, key, address)


def look_at_certificates(folder: Path, names: Sequence[str]) -> list[Certificate]:
    """Of the authority and of these members."""
    return [_authority(folder), *(_certificate(folder, name) for name in names)]


def certified(folder: Path) -> list[str]:
    """Whose certificates are on this machine, by name."""
    secrets = sorted(folder.glob(key_file(Path(), "*").name)) if folder.is_dir() else []
    names = [path.name.removesuffix(key_file(Path(), "").name) for path in secrets]
    return [name for name in names if name != AUTHORITY]


def compiled(parts: Sequence[str]) -> tuple[list[str], int]:
    """Files below these folders of the project of which a part is compiled on first use: those that are not yet, and how
    many there are."""
    sources = [path for part in parts for path in sorted((ROOT / part).rglob("*.py")) if "cache=True" in path.read_text()]
    return [str(path.relative_to(ROOT)) for path in sources if not _is_compiled(path)], len(sources)


def look_at_files(rig: Rig, services: Sequence[str]) -> list[File]:
    """What the tracker and the recogniser read, where they are among `services`."""
    found = []
    if "tracker" in services and rig.tracker is not None and rig.tracker.prior is not None:
        found.append(_file("motion prior", rig.tracker.prior))
    if "recognizer" in services and rig.recognizer is not None:
        found.append(_file("postures", rig.recognizer.model))
    return found


def _file(what: str, path: Path) -> File:
    try:
        path.read_bytes()
    except OSError as error:
        return File(what, f"{path}: {error.strerror}")
    return File(what, None)


def _authority(folder: Path) -> Certificate:
    from services.certificates.authority import CertificateError, read_certificate

    path = certificate_file(folder, AUTHORITY)
    try:
        return Certificate(AUTHORITY, None, read_certificate(str(path), path.read_bytes()).not_valid_after_utc)
    except OSError as error:
        return Certificate(AUTHORITY, f"{path}: {error.strerror}", None)
    except CertificateError as error:
        return Certificate(AUTHORITY, str(error), None)


def _certificate(folder: Path, name: str) -> Certificate:
    from services.certificates.authority import CertificateError, belong_together, read_certificate, read_key, signed_by

    path, secret, authority = certificate_file(folder, name), key_file(folder, name), certificate_file(folder, AUTHORITY)
    try:
        certificate = read_certificate(str(path), path.read_bytes())
        key = read_key(str(secret), secret.read_bytes())
        issuer = read_certificate(str(authority), authority.read_bytes())
    except OSError as error:
        return Certificate(name, f"{error.filename}: {error.strerror}", None)
    except CertificateError as error:
        return Certificate(name, str(error), None)
    if not belong_together(certificate, key):
        return Certificate(name, f"{secret} is not the key of {path}", None)
    if not signed_by(certificate, issuer):
        return Certificate(name, f"{path} is of another authority than {authority}", None)
    return Certificate(name, None, certificate.not_valid_after_utc, bool(secret.stat().st_mode & 0o077))


def _is_compiled(source: Path) -> bool:
    """Whether numba has kept machine code of a file as it is now, in one of the places where it does."""
    tag = f"py{sys.version_info.major}{sys.version_info.minor}"
    own = os.environ.get("NUMBA_CACHE_DIR")  # numba's own switch
    elsewhere = Path(own) if own else Path.home() / ".cache" / "numba"
    folders = [source.parent / "__pycache__", *elsewhere.glob(f"{source.parent.name}_*")]
    made_s = source.stat().st_mtime
    kept = (index for folder in folders for index in folder.glob(f"{source.stem}.*.{tag}.nbi"))
    return any(index.stat().st_mtime >= made_s for index in kept)
