"""Pinned versions with hashes: deploy/requirements.txt.

`python -m zenocap.tools.operate.supply_chain.lock`, or `make lock`: pip resolves the dependencies for each platform, and reports
the hash of every file.  The file names no index: pip takes the packages from whichever is configured, and refuses others.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from zenocap.common.atomic_write import write_atomically
from zenocap.tools.operate.supply_chain.dependencies import ROOT

OUTPUT = ROOT / "deploy" / "requirements.txt"
# Extras of the container, by machine: ezc3d (C3D files) has no wheels for others than x86_64.
EXTRAS = {"x86_64": ("export", "certs"), "aarch64": ("certs",)}
PYTHON = "3.11"  # of the container's base image
# glibc of the base image and before, most recent first: pip takes only the tags that it is given.
GLIBC = ("2_36", "2_35", "2_34", "2_31", "2_28", "2_27", "2_26", "2_24", "2_17", "2_12", "2_5")
HEAD = """\
# Made by `make lock` for Python {python} on Linux: run-time dependencies, what builds the package, and the extras
# {extras}.
# pip install --require-hashes --only-binary :all: -r deploy/requirements.txt; pip install --no-deps --no-build-isolation .
"""


def wanted(machine: str, project: Path = ROOT / "pyproject.toml") -> list[str]:
    """Requirements of the package, of a machine's EXTRAS, and of its build."""
    document = tomllib.loads(project.read_text(encoding="utf-8"))
    table = document["project"]
    found = [*table["dependencies"], *(text for extra in EXTRAS[machine] for text in table["optional-dependencies"][extra])]
    return [*found, *document["build-system"]["requires"]]


def resolved(machine: str, versions: Sequence[str] = ()) -> dict[tuple[str, str], str]:
    """SHA-256 of the file of each package, by name and version, as pip resolves them for a machine.

    versions: pinned ones, such as "numpy==2.4.6".
    Raises subprocess.CalledProcessError, with pip's text on standard error.
    """
    platforms = [f"--platform=manylinux_{version}_{machine}" for version in GLIBC]
    platforms += [f"--platform=manylinux2014_{machine}", f"--platform=linux_{machine}"]
    with tempfile.TemporaryDirectory() as folder:
        report, pins = Path(folder, "report.json"), Path(folder, "pins.txt")
        pins.write_text("\n".join(versions), encoding="utf-8")
        command = [
            sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--report", str(report),
            "--only-binary=:all:", f"--python-version={PYTHON}", "--implementation=cp", f"--target={folder}", *platforms,
            f"--constraint={pins}", *wanted(machine),
        ]  # fmt: skip
        subprocess.run(command, check=True)
        found = json.loads(report.read_text(encoding="utf-8"))
    digests = {}
    for one in found["install"]:
        name, version = one["metadata"]["name"].lower().replace("_", "-"), one["metadata"]["version"]
        digests[name, version] = one["download_info"]["archive_info"]["hashes"]["sha256"]
    return digests


def lock_text(by_machine: Mapping[str, Mapping[tuple[str, str], str]]) -> str:
    """Text of the file: a package with its version and the hashes of all machines in one entry.

    Raises ValueError when a package has different versions for different machines.
    """
    hashes: dict[tuple[str, str], dict[str, str]] = {}
    for machine, found in by_machine.items():
        for package, digest in found.items():
            hashes.setdefault(package, {})[machine] = digest
    names = [name for name, _ in hashes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"different versions for different machines: {', '.join(twice)}")
    extras = "; ".join(f"{' and '.join(names)} ({machine})" for machine, names in EXTRAS.items())
    head = HEAD.format(extras=extras, python=PYTHON)
    entries = []
    for (name, version), digests in sorted(hashes.items()):
        missing = len(digests) < len(by_machine)
        marker = " or ".join(f'platform_machine == "{machine}"' for machine in digests)
        pins = "".join(f" \\\n    --hash=sha256:{digest}" for digest in sorted(set(digests.values())))
        entries.append(f"{name}=={version}{f' ; {marker}' if missing else ''}{pins}")
    return head + "\n".join(entries) + "\n"


def main(output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="File to write.")] = OUTPUT) -> None:
    """Resolve the dependencies and write versions and hashes."""
    found: dict[str, dict[tuple[str, str], str]] = {}
    for machine in EXTRAS:
        pins = {f"{name}=={version}" for packages in found.values() for name, version in packages}
        found[machine] = resolved(machine, sorted(pins))
    write_atomically(output, lock_text(found).encode())
    typer.echo(f"{output}: {len({package for packages in found.values() for package in packages})} packages")


if __name__ == "__main__":
    typer.run(main)
