"""Suffixes of exported files that are not the name of their format."""

from collections.abc import Mapping

OTHER_SUFFIXES: Mapping[str, str] = {".vrma": "glb", ".usda": "usd", ".usdc": "usd", ".usdz": "usd"}


def format_name(suffix: str) -> str:
    """Return the name of a format by a file's suffix, such as ".bvh"; it need not exist."""
    return OTHER_SUFFIXES.get(suffix.lower(), suffix.lower().removeprefix("."))
