"""Versions of what is installed, and the reply of a service to a query for its rig and versions."""

from __future__ import annotations

import platform
import socket
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from zenocap.common.messages import SCHEMA_VERSION, ServiceInfo

if TYPE_CHECKING:  # keeps `zenocap --version` fast
    from zenocap.common.rig.rig import Rig

PACKAGES = ("zenocap", "eclipse-zenoh", "mcap", "msgspec", "numba", "numpy", "opencv-python-headless")


def versions() -> dict[str, str]:
    """Versions of zenocap, Python, messages (wire) and the packages that results depend on, and the processor, by name."""
    found = {"python": platform.python_version(), "processor": processor(), "wire": str(SCHEMA_VERSION)}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def processor() -> str:
    """Return the processor's name, family and model, on which the last digits of sines and matrix products depend.

    The name alone does not distinguish generations: virtual machines replace it.
    """
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.is_file() else []
    fields: dict[str, str] = {}
    for line in lines:
        key, _, value = line.partition(":")
        fields.setdefault(key.strip(), value.strip())
    if "model name" not in fields:
        return platform.processor() or platform.machine()
    return f"{fields['model name']}, family {fields.get('cpu family', '?')}, model {fields.get('model', '?')}"


def service_info(rig: Rig, service: str, id: str, now_ns: int) -> ServiceInfo:
    """Rig and versions of a service on this machine."""
    return ServiceInfo(
        frame=0, captured_ns=now_ns, service=service, id=id, host=socket.gethostname()[:1000], digest=rig.digest,
        versions={name: text[:1000] for name, text in versions().items()},
    )  # fmt: skip
