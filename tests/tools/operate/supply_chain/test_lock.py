"""The pinned versions of deploy/requirements.txt: all of them, with hashes, and no index."""

import re

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.places import ROOT
from zenocap.tools.operate.supply_chain.lock import EXTRAS, OUTPUT, lock_text, wanted

ENTRY = re.compile(r'([a-z0-9.\-]+)==(\S+)(?: ; platform_machine == "\w+")?((?: \\\n    --hash=sha256:[0-9a-f]{64})+)\n')


def entries() -> dict[str, tuple[str, int]]:
    """Version and number of hashes by name; fails for a file of another form."""
    lines = OUTPUT.read_text().split("\n", 3)
    assert all(line.startswith("#") for line in lines[:3])
    found = {match[1]: (match[2], match[3].count("sha256:")) for match in ENTRY.finditer(lines[3])}
    assert ENTRY.sub("", lines[3]) == ""
    return found


def test_every_requirement_is_pinned_within_the_limits_of_the_project() -> None:
    found = entries()
    for requirement in map(Requirement, wanted("x86_64")):
        version, _ = found[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), requirement
    assert len(found) > len(wanted("x86_64"))  # indirect ones too


def test_every_package_has_a_hash_for_each_machine_or_one_for_all() -> None:
    assert {count for _, count in entries().values()} <= {1, len(EXTRAS)}


def test_no_index_is_named() -> None:
    text = OUTPUT.read_text() + (ROOT / "deploy" / "Dockerfile").read_text()
    assert "://" not in text
    assert "--find-links" not in text


def test_the_container_installs_only_what_is_pinned() -> None:
    lines = (ROOT / "deploy" / "Dockerfile").read_text().splitlines()
    installs = [line for line in lines if "pip install" in line]
    assert len(installs) == 2
    assert all("--require-hashes" in line or "--no-deps --no-build-isolation" in line for line in installs)


def test_different_versions_for_different_machines_are_an_error() -> None:
    text = lock_text({"x86_64": {("a", "1"): "0" * 64, ("b", "2"): "2" * 64}, "aarch64": {("a", "1"): "1" * 64}})
    assert f"\na==1 \\\n    --hash=sha256:{'0' * 64} \\\n    --hash=sha256:{'1' * 64}\n" in text
    assert text.endswith(f'\nb==2 ; platform_machine == "x86_64" \\\n    --hash=sha256:{"2" * 64}\n')
    with pytest.raises(ValueError, match="different versions for different machines: a"):
        lock_text({"x86_64": {("a", "1"): "0"}, "aarch64": {("a", "2"): "1"}})
