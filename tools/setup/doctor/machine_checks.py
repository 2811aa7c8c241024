"""Checks of this machine: endpoints, sources, disk, ports, certificates, compiled code, and files."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from zenocap.common.bus.certificate import WARNED_DAYS, days_left
from zenocap.common.recording.log import shortage
from zenocap.tools.setup.doctor.finding import CheckResult, ok, warning, wrong

SOON = timedelta(days=WARNED_DAYS)
SourceKind = Literal["good", "used", "missing", "denied", "size", "broken"]


@dataclass(frozen=True)
class Endpoint:
    """An endpoint to connect to.  problem: reason of a failed connection, else None.  trusted: False when its certificate
    is of another authority, or when it rejects ours."""

    address: str
    problem: str | None = None
    trusted: bool = True


@dataclass(frozen=True)
class SourceState:
    """The source of a viewer.  kind: kind of result; "used": its viewer runs and has opened it.

    local: whether it must be on this machine; otherwise it may be on the viewer's machine.
    """

    viewer: str
    kind: SourceKind
    words: str
    local: bool


@dataclass(frozen=True)
class Disk:
    """Disk of the takes.  problem: reason why it cannot be written, else None.  free_bytes: None if unknown."""

    folder: Path
    problem: str | None
    free_bytes: int | None


@dataclass(frozen=True)
class Port:
    """A port to listen on.  key: its rig-file key.  problem: reason why it is unavailable.  ours: used by this rig."""

    title: str
    key: str
    address: str
    problem: str | None = None
    ours: bool = False


@dataclass(frozen=True)
class Certificate:
    """Certificate of a member or the authority.  problem: fault of the files, else None.  ends: None when unreadable."""

    name: str
    problem: str | None
    ends: datetime | None
    readable_by_others: bool = False


def check_endpoint(endpoint: Endpoint) -> CheckResult:
    if endpoint.problem is None:
        return ok("endpoint", f"{endpoint.address} accepts connections")
    remedy = "check that the router or the listening service runs, the address is right, and no firewall blocks the port"
    if not endpoint.trusted:
        remedy = "check the address, and that the certificates on both machines are of one authority (zenocap certs)"
    return wrong("endpoint", f"{endpoint.address}: {endpoint.problem}", remedy)


def check_source(source: SourceState) -> CheckResult:
    check = f"source of viewer {source.viewer}"
    if source.kind in ("good", "used"):
        return ok(check, source.words)
    remedies = {
        "missing": "plug it in, or correct `source` in the rig file",
        "denied": "let this user read it; cameras: add the user to the group video, and log in again",
        "size": "calibrate at the size of the camera's images, or set the camera to the calibrated size",
        "broken": "another program may use it; for streams check the address, for files the codec",
    }
    remedy = remedies[source.kind]
    if source.local or source.kind == "size":
        return wrong(check, source.words, remedy)
    elsewhere = f"ignore this if viewer {source.viewer} runs on another machine"
    return warning(check, source.words, f"{elsewhere}; else: {remedy}")


def check_disk(disk: Disk) -> CheckResult:
    if disk.problem is not None:
        remedy = "let this user write there, or set `folder` in the [log] table"
        return wrong("disk", f"{disk.folder}: {disk.problem}", remedy)
    text = None if disk.free_bytes is None else shortage(disk.free_bytes, 0.0)
    if text is not None:
        return warning("disk", f"{disk.folder}: {text}", "delete old takes, or set `folder` in the [log] table")
    free = "" if disk.free_bytes is None else f", {disk.free_bytes / 1e9:.0f} GB free"
    return ok("disk", f"takes are written to {disk.folder}{free}")


def check_port(port: Port) -> CheckResult:
    check = f"port of the {port.title}"
    if port.ours:
        return ok(check, f"{port.address} is in use by this rig, which is running")
    if port.problem is None:
        return ok(check, f"{port.address} is free")
    remedy = f"end the program that uses it, or change `{port.key}` in the rig file"
    return wrong(check, f"{port.address}: {port.problem}", remedy)


def check_certificate(certificate: Certificate, now: datetime) -> CheckResult:
    check = f"certificate {certificate.name}"
    if certificate.problem is not None or certificate.ends is None:
        remedy = "create it with `zenocap certs` and copy it to this machine"
        return wrong(check, certificate.problem or "cannot be read", remedy)
    if certificate.readable_by_others:
        return wrong(check, "other users of this machine can read its private key", f"chmod 600 {certificate.name}-key.pem")
    left, day = days_left(certificate.ends, now), f"{certificate.ends:%Y-%m-%d}"
    renew = "`zenocap certs RIG --renew`, and copy it to this machine"
    if certificate.ends <= now:
        return wrong(check, f"expired on {day}", renew)
    if certificate.ends - now < SOON:
        return warning(check, f"expires on {day}, {left} days left", renew)
    return ok(check, f"valid until {day}, {left} days left")


def check_compiled(missing: Sequence[str]) -> CheckResult:
    """Check of the compiled code.  missing: parts of `zenocap warmup` that are not in the cache."""
    if not missing:
        return ok("compiled", "the code of all services of this machine")
    remedy = "zenocap warmup, as the user who runs the services"
    return warning("compiled", f"not compiled yet: {', '.join(missing)}: the first start takes some 20 s longer", remedy)


def check_file(title: str, problem: str | None) -> CheckResult:
    """Check of an input file of a service.  problem: reason why it cannot be read, else None."""
    if problem is None:
        return ok(title, "can be read")
    return wrong(title, problem, "correct the rig file, or copy the file to this machine")
