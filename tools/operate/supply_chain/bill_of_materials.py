"""Software bill of materials (SBOM) of the run-time dependencies: CycloneDX 1.6 as JSON.

`python -m zenocap.tools.operate.supply_chain.bill_of_materials -o FILE`, or `make sbom`.  It describes what is installed here;
equal installations give equal bytes.
"""

import json
import tomllib
from pathlib import Path
from typing import Annotated

import typer

from zenocap.common.atomic_write import write_atomically
from zenocap.tools.operate.supply_chain.dependencies import ROOT, Dependency, copyleft, run_time_dependencies

FORMAT, VERSION = "CycloneDX", "1.6"


def bill_of_materials(dependencies: dict[str, Dependency], name: str, version: str, licence: str) -> dict[str, object]:
    """The document.  name, version, licence: of the program itself."""
    own = {
        "type": "application", "bom-ref": _reference(name, version), "name": name, "version": version,
        "purl": _reference(name, version), "licenses": [{"expression": licence}],
    }  # fmt: skip
    packages = dependencies.values()
    references = {one.name: _reference(one.name, one.version) for one in packages}
    graph = [(own["bom-ref"], [one.name for one in packages if one.direct])]
    graph += [(references[one.name], [other for other in one.requires if other in references]) for one in packages]
    return {
        "$schema": f"http://cyclonedx.org/schema/bom-{VERSION}.schema.json", "bomFormat": FORMAT, "specVersion": VERSION,
        "version": 1, "metadata": {"component": own},
        "components": [_component(one, references[one.name]) for one in packages],
        "dependencies": [{"ref": ref, "dependsOn": sorted(references[name] for name in names)} for ref, names in graph],
    }  # fmt: skip


def _component(one: Dependency, reference: str) -> dict[str, object]:
    component: dict[str, object] = {
        "type": "library", "bom-ref": reference, "name": one.name, "version": one.version, "purl": reference,
    }  # fmt: skip
    if one.licence:
        component["licenses"] = [{"expression": one.licence}]
    if one.bundled:
        texts = [f"{file} {copyleft(file)}".rstrip() for file in sorted(one.bundled)]
        component["properties"] = [{"name": "zenocap:bundled-library", "value": text} for text in texts]
    return component


def _reference(name: str, version: str) -> str:
    return f"pkg:pypi/{name}@{version}"


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="File to write.")] = Path(
        "build/sbom.cdx.json"
    ),
    extras: Annotated[str, typer.Option(help="Extras, separated by commas; all: every optional tool.")] = "all",
) -> None:
    """Write the bill of materials of what is installed here."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = run_time_dependencies([extra for extra in extras.split(",") if extra])
    document = bill_of_materials(found, table["name"], table["version"], table["license"])
    output.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(output, (json.dumps(document, indent=1) + "\n").encode())
    bundled = sum(len(one.bundled) for one in found.values())
    typer.echo(f"{output}: {len(found)} packages, {bundled} libraries inside their wheels")


if __name__ == "__main__":
    typer.run(main)
