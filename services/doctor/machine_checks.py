"""What this machine has, judged: endpoints, sources, disk, ports, certificates, what is compiled, and files."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from common.take.space import shortage
from services.doctor.finding import Finding, ok, warning, wrong

SOON = timedelta(days=30)


@dataclass(frozen=True)
class Endpoint:
    """One that is to be called.  problem: why it does not answer; None when it does.  trusted: False when it answers with a
    certificate of others, or does not take ours."""

    address: str
    problem: str | None = None
    trusted: bool = True


@dataclass(frozen=True)
class SourceLook:
    """The source of a viewer.  kind: what is the matter with it; "used": its viewer runs and has it.

    local: it must be on this machine; else it may be on the viewer's own.
    """

    viewer: str
    kind: Literal["good", "used", "missing", "denied", "size", "broken"]
    words: str
    local: bool


@dataclass(frozen=True)
class Disk:
    """Where takes go.  problem: why nothing can be written there.  free_bytes: None where the system does not tell."""

    folder: Path
    problem: str | None
    free_bytes: int | None


@dataclass(frozen=True)
class Port:
    """One to be listened on.  key: what says so in the rig.  problem: why it cannot be.  ours: by a service of this rig."""

    what: str
    key: str
    address: str
    problem: str | None = None
    ours: bool = False


@dataclass(frozen=True)
class Certificate:
    """Of a member, or the authority.  problem: what is wrong with the files; ends: None where they cannot be read."""

    name: str
    problem: str | None
    ends: datetime | None
    readable_by_others: bool = False


@dataclass(frozen=True)
class File:
    """What a service reads.  problem: None when it can."""

    what: str
    problem: str | None


def check_endpoint(endpoint: Endpoint) -> Finding:
    if endpoint.problem is None:
        return ok("endpoint", f"{endpoint.address} answers")
    words = f"{endpoint.address}: {endpoint.problem}"
    if not endpoint.trusted:
        return wrong(
            "endpoint", words, "is the address right, and are the certificates on both machines of one zenocap certs?"
        )
    return wrong(
        "endpoint",
        words,
        "is it started (zenocap router, or the one that listens), is the address right, does a firewall block the port?",
    )


def check_source(look: SourceLook) -> Finding:
    check = f"source of viewer {look.viewer}"
    if look.kind in ("good", "used"):
        return ok(check, look.words)
    remedies = {
        "missing": "plug it in, or correct `source` in the rig file",
        "denied": "let this user read it; cameras: add the user to the group video, and log in again",
        "size": "calibrate at the size of the camera's images, or set the camera to the calibrated size",
        "broken": "another program may use it; for streams check the address, for files the codec",
    }
    if look.local or look.kind == "size":
        return wrong(check, look.words, remedies[look.kind])
    return warning(
        check, look.words, f"no matter where viewer {look.viewer} runs on another machine; else: {remedies[look.kind]}"
    )


def check_disk(disk: Disk) -> Finding:
    if disk.problem is not None:
        return wrong(
            "disk", f"{disk.folder}: {disk.problem}", "let this user write there, or set `folder` in the [log] table"
        )
    words = None if disk.free_bytes is None else shortage(disk.free_bytes, 0.0)
    if words is not None:
        return warning("disk", f"{disk.folder}: {words}", "delete old takes, or set `folder` in the [log] table")
    free = "" if disk.free_bytes is None else f", {disk.free_bytes / 1e9:.0f} GB free"
    return ok("disk", f"takes go to {disk.folder}{free}")


def check_port(port: Port) -> Finding:
    check = f"port of the {port.what}"
    if port.ours:
        return ok(check, f"{port.address} is in use by this rig, which is running")
    if port.problem is None:
        return ok(check, f"{port.address} is free")
    return wrong(
        check, f"{port.address}: {port.problem}", f"end the program that has it, or change `{port.key}` in the rig file"
    )


def check_certificate(certificate: Certificate, now: datetime) -> Finding:
    check = f"certificate {certificate.name}"
    if certificate.problem is not None or certificate.ends is None:
        return wrong(check, certificate.problem or "cannot be read", "make it with `zenocap certs` and copy it here")
    if certificate.readable_by_others:
        return wrong(check, "others on this machine can read its private key", f"chmod 600 {certificate.name}-key.pem")
    day = f"{certificate.ends:%Y-%m-%d}"
    if certificate.ends <= now:
        return wrong(check, f"expired on {day}", "`zenocap certs RIG --renew`, and copy it here")
    if certificate.ends - now < SOON:
        return warning(check, f"expires on {day}", "`zenocap certs RIG --renew`, and copy it here")
    return ok(check, f"valid until {day}")


def check_compiled(missing: Sequence[str], all_of_them: int) -> Finding:
    """missing: files with parts that are compiled on first use, and are not yet."""
    if not missing:
        return ok("compiled", f"all of {all_of_them} files")
    words = (
        f"{len(missing)} of {all_of_them} files are not compiled yet, such as {missing[0]}: the first start takes some 20 s"
    )
    return warning(
        "compiled", words, "start it once before it matters, as the user who runs it; zenocap warmup where all is installed"
    )


def check_file(file: File) -> Finding:
    if file.problem is None:
        return ok(file.what, "can be read")
    return wrong(file.what, file.problem, "correct the rig file, or copy the file to this machine")
