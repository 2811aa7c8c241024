"""Lists of revoked certificates: only what the authority has signed is read."""

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from zenocap.common.bus import zenoh_router
from zenocap.common.bus.access import ROUTER, Member, access_control
from zenocap.common.bus.revocations import MAX_BYTES, BadRevocations, Revocations, read_revocations
from zenocap.common.bus.security import RouterFiles
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.tools.setup.certificates.folder import certify, revoke

NOW = datetime(2026, 1, 2, tzinfo=UTC)
ONE, TWO = Member("viewer", "1"), Member("viewer", "2")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("certs", "other"):
        certify(tmp_path / name, "studio", {ONE: ["h"]}, NOW, 30)
    return tmp_path / "certs"


def test_a_list_is_read_as_it_was_signed(folder: Path) -> None:
    signed = revoke(folder, "studio", [ONE], NOW)
    found = read_revocations("list", signed.encoded(), (folder / "authority.pem").read_bytes())
    assert found == signed
    assert (found.number, dict(found.generations)) == (1, {"studio/viewer/1": 1})


def test_a_changed_list_or_one_of_another_authority_is_refused(folder: Path) -> None:
    data = revoke(folder, "studio", [ONE], NOW).encoded()
    authority = (folder / "authority.pem").read_bytes()
    for change in ({"number": 2}, {"generations": {}}, {"generations": {"studio/viewer/2": 1}}, {"signature": "AAAA"}):
        with pytest.raises(BadRevocations, match=r"^list: not signed by the authority"):
            read_revocations("list", json.dumps(json.loads(data) | change).encode(), authority)
    with pytest.raises(BadRevocations, match="not signed"):
        read_revocations("list", data, (folder.parent / "other" / "authority.pem").read_bytes())


@pytest.mark.parametrize(
    "data",
    [b"", b"[]", b"\xff", b"{}", b'{"number":0,"generations":{},"signature":""}', b'{"number":1}', b" " * (MAX_BYTES + 1)],
)
def test_what_is_no_list_is_refused(folder: Path, data: bytes) -> None:
    with pytest.raises(BadRevocations, match=r"^list: no list of revocations"):
        read_revocations("list", data, (folder / "authority.pem").read_bytes())


def test_access_rules_admit_the_present_generation_only() -> None:
    settings = json.loads(access_control({"studio": [ONE, TWO]}, {"studio/viewer/1": 2, "lab/viewer/2": 1}))
    names = [subject["cert_common_names"] for subject in settings["subjects"]]
    assert names == [[ROUTER], ["studio/viewer/1@2"], ["studio/viewer/2"]]


def test_an_empty_list_signs_its_number() -> None:
    assert Revocations(1).signed_bytes() != Revocations(2).signed_bytes()


def test_a_router_that_cannot_check_a_signature_does_not_ignore_the_list(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    revoke(folder, "studio", [ONE], NOW)
    monkeypatch.setattr(zenoh_router, "find_spec", lambda name: None)
    authority, certificate, revoked = (folder / name for name in ("authority.pem", "viewer-1.pem", "revoked.json"))
    files = RouterFiles(("studio",), authority, certificate, revoked, (revoked,))
    with pytest.raises(BadRevocations, match=r"revoked\.json: its signature cannot be checked: .+ -m pip install"):
        zenoh_router.router(lambda revocations: ZenohOptions(), lambda: False, files)
