"""Run-time dependencies of the checkout, with the licences installed here."""

import re
import tomllib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[3]

# Licences as the packages' metadata have them, to SPDX.
SPDX = {
    "OSI Approved :: Apache Software License": "Apache-2.0",
    "OSI Approved :: BSD License": "BSD-3-Clause",
    "OSI Approved :: Eclipse Public License 2.0 (EPL-2.0)": "EPL-2.0",
    "OSI Approved :: ISC License (ISCL)": "ISC",
    "OSI Approved :: MIT License": "MIT",
    "OSI Approved :: Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "OSI Approved :: Python Software Foundation License": "PSF-2.0",
    "Apache 2": "Apache-2.0",
    "Apache 2.0": "Apache-2.0",
    "Apache License 2.0": "Apache-2.0",
    "Apache License, Version 2.0": "Apache-2.0",
    "BSD": "BSD-3-Clause",
    "BSD 3-Clause License": "BSD-3-Clause",
    "BSD-2": "BSD-2-Clause",
    "EPL-2.0 OR Apache-2.0": "EPL-2.0 OR Apache-2.0",
    "MIT License": "MIT",
    "PSF": "PSF-2.0",
}
# Permissive ones, which an Apache-2.0 program may be distributed with.
ALLOWED = frozenset({
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0", "HPND",
    "ISC", "MIT", "MIT-0", "MIT-CMU", "PSF-2.0", "Python-2.0", "Unlicense", "Zlib",
})  # fmt: skip
# Runtime libraries of GCC in wheels of NumPy and SciPy: their exception permits distribution with any program.
ALLOWED_EXCEPTIONS = frozenset({"GPL-3.0-or-later WITH GCC-exception-3.1"})

# Copyleft libraries that wheels contain beside the package's own licence: whoever distributes them, as in an image, has
# their obligations.  By the beginning of the file's name.
COPYLEFT = {
    "libx264": "GPL-2.0-or-later", "libx265": "GPL-2.0-or-later", "libgmp": "LGPL-3.0-or-later OR GPL-2.0-or-later",
    "libgnutls": "LGPL-2.1-or-later", "libasound": "LGPL-2.1-or-later",
    "libhogweed": "LGPL-3.0-or-later OR GPL-2.0-or-later", "libmp3lame": "LGPL-2.0-or-later",
    "libnettle": "LGPL-3.0-or-later OR GPL-2.0-or-later",
    "libunistring": "LGPL-3.0-or-later OR GPL-2.0-or-later", "libav": "LGPL-2.1-or-later", "libsw": "LGPL-2.1-or-later",
    "libquadmath": "LGPL-2.1-or-later", "libgfortran": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libgcc": "GPL-3.0-or-later WITH GCC-exception-3.1", "libstdc": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "libgomp": "GPL-3.0-or-later WITH GCC-exception-3.1", "libQt": "LGPL-3.0-only",
}  # fmt: skip


@dataclass(frozen=True)
class Dependency:
    """name: canonical.  licence: SPDX expression, "" without one.  direct: required by zenocap itself.

    bundled: files of other projects' libraries in the wheel.
    """

    name: str
    version: str
    licence: str
    requires: tuple[str, ...]
    bundled: tuple[str, ...] = ()
    direct: bool = False


def run_time_dependencies(extras: Collection[str] = ("all",)) -> dict[str, Dependency]:
    """Dependencies of this checkout that are installed here, by name.

    Raises PackageNotFoundError, which names the package, when one is not installed.
    """
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = table["optional-dependencies"]
    first = [*table["dependencies"], *(text for extra in extras for text in optional[extra])]
    own = canonicalize_name(table["name"])
    found: dict[str, Dependency] = {}
    waiting = [(Requirement(text), True) for text in first]
    while waiting:
        requirement, direct = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name == own:
            waiting += [(Requirement(text), True) for extra in requirement.extras for text in optional[extra]]
            continue
        if name in found:
            continue
        installed = distribution(name)
        needed = [one for one in map(Requirement, installed.requires or ()) if _applies(one, requirement.extras)]
        found[name] = Dependency(
            name, installed.version, licence_of(installed), tuple(sorted({canonicalize_name(one.name) for one in needed})),
            tuple(_bundled(installed)), direct,
        )  # fmt: skip
        waiting += [(one, False) for one in needed]
    return dict(sorted(found.items()))


def licence_of(installed: Distribution) -> str:
    """SPDX expression of the metadata: expression, licence field, classifiers, or title of the licence file; or ""."""
    fields = installed.metadata
    if "License-Expression" in fields:
        return fields["License-Expression"]
    classifiers = [text.removeprefix("License :: ") for text in fields.get_all("Classifier") or () if "License ::" in text]
    known = [SPDX[text] for text in classifiers if text in SPDX]
    text = fields["License"].strip() if "License" in fields else ""
    if text in SPDX or text in ALLOWED:  # more exact than a classifier, such as BSD-2-Clause
        return SPDX.get(text, text)
    return " OR ".join(known) or _licence_of_text(installed)


def _licence_of_text(installed: Distribution) -> str:
    for file in installed.files or ():
        if file.name.upper().startswith(("LICENSE", "LICENCE", "COPYING")) and ".dist-info" in str(file):
            title = file.read_text(encoding="utf-8").strip().partition("\n")[0].strip()
            if title in SPDX:
                return SPDX[title]
    return ""


def refused(licence: str) -> list[str]:
    """The parts of an SPDX expression that are not allowed; one allowed part of an OR is enough."""
    if not licence:
        return ["no licence in the metadata"]
    parts = re.split(r"\s+AND\s+", licence.replace("(", "").replace(")", ""))
    return [part for part in parts if not {*re.split(r"\s+OR\s+", part)} & (ALLOWED | ALLOWED_EXCEPTIONS)]


def copyleft(file: str) -> str:
    """Licence of a bundled library if it is a known copyleft one, else ""."""
    return next((licence for start, licence in COPYLEFT.items() if file.startswith(start)), "")


def missing(extras: Collection[str] = ("all",)) -> str | None:
    """Name of a dependency that is not installed here, or has no metadata; None when all are."""
    try:
        run_time_dependencies(extras)
    except PackageNotFoundError as error:
        return str(error.name)
    return None


def _applies(requirement: Requirement, extras: Collection[str]) -> bool:
    if requirement.marker is None:
        return True
    return any(requirement.marker.evaluate({"extra": extra}) for extra in ("", *extras))


def _bundled(installed: Distribution) -> Iterator[str]:
    """Shared libraries of other projects in the wheel, as auditwheel and delvewheel put them there."""
    for file in installed.files or ():
        folder = file.parts[0]
        if folder.endswith(".libs") and len(file.parts) > 1:
            yield file.name
