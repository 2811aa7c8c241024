"""Every run-time dependency has a licence that permits distribution, and is in the bill of materials."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.tools.operate.supply_chain.bill_of_materials import bill_of_materials
from zenocap.tools.operate.supply_chain.dependencies import Dependency, copyleft, missing, refused, run_time_dependencies

BASE_MISSING, ALL_MISSING = missing(()), missing(("all",))
needs_base = pytest.mark.skipif(BASE_MISSING is not None, reason=f"not installed here, or without metadata: {BASE_MISSING}")
needs_all = pytest.mark.skipif(ALL_MISSING is not None, reason=f"not installed here, or without metadata: {ALL_MISSING}")


@pytest.mark.slow
@pytest.mark.parametrize("extras", [pytest.param((), marks=needs_base), pytest.param(("all",), marks=needs_all)])
def test_every_package_has_an_allowed_licence(extras: tuple[str, ...]) -> None:
    """Of the base install, and of all extras."""
    found = {one.name: refused(one.licence) for one in run_time_dependencies(extras).values()}
    assert {name: parts for name, parts in found.items() if parts} == {}


# Wheels with libraries under the GPL without an exception: in docs/machines.md, because an image contains them.
GPL_INSIDE = {"av": {"libx264", "libx265"}}


@pytest.mark.slow
@needs_all
def test_the_wheels_with_libraries_under_the_gpl_are_known() -> None:
    found: dict[str, set[str]] = {}
    for one in run_time_dependencies(("all",)).values():
        files = {file.partition("-")[0] for file in one.bundled if copyleft(file).startswith("GPL-2.0")}
        found |= {one.name: files} if files else {}
    assert all(files <= GPL_INSIDE.get(name, set()) for name, files in found.items()), found
    text = (ROOT / "docs" / "machines.md").read_text()
    assert all(file.removeprefix("lib") in text for files in GPL_INSIDE.values() for file in files)


@pytest.mark.parametrize(
    ("licence", "parts"),
    [
        ("MIT", []),
        ("EPL-2.0 OR Apache-2.0", []),
        ("BSD-3-Clause AND 0BSD AND MIT AND Zlib AND CC0-1.0", []),
        ("Apache-2.0 WITH LLVM-exception AND BSD-2-Clause", []),
        ("BSD-3-Clause AND (MIT OR GPL-2.0-only)", []),
        ("BSD-3-Clause AND AGPL-3.0-only", ["AGPL-3.0-only"]),
        ("GPL-3.0-or-later", ["GPL-3.0-or-later"]),
        ("", ["no licence in the metadata"]),
    ],
)
def test_an_expression_is_refused_by_its_parts(licence: str, parts: list[str]) -> None:
    assert refused(licence) == parts


@needs_base
def test_dependencies_are_followed_to_the_end() -> None:
    found = run_time_dependencies(())
    assert {"numba", "websockets", "typer"} <= {name for name, one in found.items() if one.direct}
    assert not found["llvmlite"].direct
    assert all(other in found for one in found.values() for other in one.requires)
    assert "pytest" not in found


def test_the_bill_of_materials_is_cyclonedx() -> None:
    found = {"a": Dependency("a", "1.0", "MIT", ("b",), direct=True), "b": Dependency("b", "2.0", "", (), ("libx.so.1",))}
    document = bill_of_materials(found, "zenocap", "0.2.0", "Apache-2.0")
    assert (document["bomFormat"], document["specVersion"], document["version"]) == ("CycloneDX", "1.6", 1)
    assert [one["bom-ref"] for one in document["components"]] == ["pkg:pypi/a@1.0", "pkg:pypi/b@2.0"]
    assert document["components"][0]["licenses"] == [{"expression": "MIT"}]
    assert "licenses" not in document["components"][1]
    assert document["components"][1]["properties"] == [{"name": "zenocap:bundled-library", "value": "libx.so.1"}]
    assert document["dependencies"] == [
        {"ref": "pkg:pypi/zenocap@0.2.0", "dependsOn": ["pkg:pypi/a@1.0"]},
        {"ref": "pkg:pypi/a@1.0", "dependsOn": ["pkg:pypi/b@2.0"]},
        {"ref": "pkg:pypi/b@2.0", "dependsOn": []},
    ]


@pytest.mark.nightly
@needs_base
def test_equal_installations_give_equal_files(tmp_path: Path) -> None:
    for name in ("a", "b"):
        command = [sys.executable, "-m", "zenocap.tools.operate.supply_chain.bill_of_materials", "--extras", "", "-o", name]
        subprocess.run(command, cwd=tmp_path, env=None, check=True, capture_output=True)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    document = json.loads((tmp_path / "a").read_text())
    references = [one["bom-ref"] for one in document["components"]]
    assert len(references) == len(set(references)) > 20
    assert {one["ref"] for one in document["dependencies"]} == {*references, document["metadata"]["component"]["bom-ref"]}
    assert str(ROOT) not in (tmp_path / "a").read_text()
