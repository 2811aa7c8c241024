"""Versions of what is installed, and the reply of a service to a query for its rig and versions."""

from __future__ import annotations

import platform
import socket
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from zenocap.common.messages import SCHEMA_VERSION, ServiceInfo
from zenocap.common.processor import instructions, processor

if TYPE_CHECKING:  # keeps `zenocap --version` fast
    from zenocap.common.rig.rig import Rig

PACKAGES = ("zenocap", "eclipse-zenoh", "mcap", "msgspec", "numba", "numpy", "opencv-python-headless")


def versions() -> dict[str, str]:
    """Versions of zenocap, Python, messages (wire) and what results depend on: packages and processor; by name."""
    machine = {"processor": processor(), "instructions": instructions()}
    found = {"python": platform.python_version(), **machine, "wire": str(SCHEMA_VERSION)}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def service_info(rig: Rig, service: str, id: str, now_ns: int) -> ServiceInfo:
    """Rig and versions of a service on this machine."""
    return ServiceInfo(
        frame=0, captured_ns=now_ns, service=service, id=id, host=socket.gethostname()[:1000], digest=rig.digest,
        versions={name: text[:1000] for name, text in versions().items()},
    )  # fmt: skip
