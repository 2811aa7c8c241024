"""Which versions a take was made with."""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("zenocap", "eclipse-zenoh", "mcap", "msgspec", "numba", "numpy", "opencv-python-headless")


def versions() -> dict[str, str]:
    """This program, Python and the packages that a result depends on, by name."""
    found = {"python": platform.python_version(), "processor": processor()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def processor() -> str:
    """The processor's name: the last digits of sines and products of matrices depend on it."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
