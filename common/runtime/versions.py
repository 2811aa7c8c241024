"""Which versions a take was made with."""

import platform
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("zenocap", "eclipse-zenoh", "mcap", "msgspec", "numba", "numpy", "opencv-python-headless")


def versions() -> dict[str, str]:
    """This program, Python and the packages that a result depends on, by name."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
