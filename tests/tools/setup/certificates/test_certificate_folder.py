"""Folder of certificates: permissions, files kept, renewed, revoked, or rejected as inconsistent."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from zenocap.common.bus.access import ROUTER, Member
from zenocap.common.errors import UserError
from zenocap.common.rig.security import generations_in
from zenocap.tools.setup.certificates.authority import common_name, read_certificate, signed_by
from zenocap.tools.setup.certificates.folder import certify, known, ready_authority, renew_expiring, renewed, revoke
from zenocap.tools.setup.doctor.machine_probe import look_at_certificates

NOW = datetime(2026, 1, 2, tzinfo=UTC)
HERE = ("localhost", "127.0.0.1")
REACHED = ("localhost", "192.168.1.7")
ONE, TWO = Member("viewer", "1"), Member("viewer", "2")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_private_keys_are_readable_by_their_owner_only(tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    certify(folder, "studio", {ONE: HERE}, NOW, 30)
    modes = {path.name: path.stat().st_mode & 0o777 for path in folder.iterdir()}
    assert modes == {"authority.pem": 0o644, "authority-key.pem": 0o600, "viewer-1.pem": 0o644, "viewer-1-key.pem": 0o600}
    assert folder.stat().st_mode & 0o777 == 0o700


def test_existing_certificates_are_kept_when_new_ones_are_added(tmp_path: Path) -> None:
    assert [one.done for one in certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)] == ["made"]
    before = contents(tmp_path)
    assert [one.done for one in certify(tmp_path, "studio", {ONE: HERE, TWO: HERE}, NOW, 30)] == ["kept", "made"]
    after = contents(tmp_path)
    assert {name: after[name] for name in before} == before


def test_renewed_certificates_are_signed_by_the_same_authority(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    before = contents(tmp_path)
    later = NOW + timedelta(days=20)
    (made,) = certify(tmp_path, "studio", {ONE: HERE}, later, 30, renew=True)
    after = contents(tmp_path)
    assert (made.done, made.ends) == ("renewed", later + timedelta(days=30))
    assert {name for name in after if after[name] != before[name]} == {"viewer-1.pem", "viewer-1-key.pem"}
    authority = read_certificate("", after["authority.pem"])
    assert signed_by(read_certificate("", after["viewer-1.pem"]), authority)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("authority-key.pem", None, "missing beside the other half"),
        ("authority.pem", None, "missing beside the other half"),
        ("authority.pem", "x", "no certificate"),
        ("viewer-1.pem", None, "missing beside its key"),
        ("viewer-1.pem", "x", "no certificate"),
    ],
)
def test_missing_or_damaged_file_is_named_in_the_error(
    tmp_path: Path, file: str, content: str | None, message: str
) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    (tmp_path / file).unlink()
    if content is not None:
        (tmp_path / file).write_text(content)
    with pytest.raises(UserError, match=f"{file}: {message}"):
        certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)


def test_certificate_for_another_host_or_rig_is_rejected_and_not_overwritten(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    before = contents(tmp_path)
    with pytest.raises(UserError, match=r"not for 192\.168\.1\.11: --renew"):
        certify(tmp_path, "studio", {ONE: (*HERE, "192.168.1.11")}, NOW, 30)
    with pytest.raises(UserError, match="exists already, of 'studio/viewer/1'"):
        certify(tmp_path, "lab", {ONE: HERE}, NOW, 30)
    assert contents(tmp_path) == before


def test_certificate_of_another_authority_is_rejected(tmp_path: Path) -> None:
    certify(tmp_path / "a", "studio", {ONE: HERE}, NOW, 30)
    certify(tmp_path / "b", "studio", {ONE: HERE}, NOW, 30)
    for name in ("authority.pem", "authority-key.pem"):
        (tmp_path / "a" / name).replace(tmp_path / "b" / name)
    with pytest.raises(UserError, match="signed by another authority"):
        certify(tmp_path / "b", "studio", {ONE: HERE}, NOW, 30)


def test_expired_authority_is_rejected(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: HERE}, NOW, 30)
    with pytest.raises(UserError, match="expired on 2035"):
        ready_authority(tmp_path, "studio", NOW + timedelta(days=3651))


def name_of(folder: Path, member: Member) -> str:
    return common_name(read_certificate("", (folder / f"{member.name}.pem").read_bytes()))


def test_a_new_certificate_of_a_revoked_member_has_the_next_generation_and_the_same_hosts(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: REACHED, TWO: REACHED}, NOW, 30)
    assert known(tmp_path).number == 0
    for number in (1, 2):
        assert revoke(tmp_path, "studio", [ONE], NOW).number == number
        assert generations_in(tmp_path) == {"studio/viewer/1": number}
        (made,) = renewed(tmp_path, "studio", [ONE], NOW, 30)
        assert name_of(tmp_path, ONE) == f"studio/viewer/1@{number}"
        assert set(made.hosts) == set(REACHED)
    assert name_of(tmp_path, TWO) == "studio/viewer/2"
    assert [one.done for one in certify(tmp_path, "studio", {ONE: REACHED, TWO: REACHED}, NOW, 30)] == ["kept", "kept"]


def test_a_revoked_certificate_is_not_kept_and_doctor_names_it(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: REACHED}, NOW, 30)
    revoke(tmp_path, "studio", [ONE], NOW)
    with pytest.raises(UserError, match=r"viewer-1\.pem: is revoked: --renew replaces it"):
        certify(tmp_path, "studio", {ONE: REACHED}, NOW, 30)
    *_, found = look_at_certificates(tmp_path, ["viewer-1"])
    assert found.problem == f"{tmp_path / 'viewer-1.pem'} is revoked"
    certify(tmp_path, "studio", {ONE: REACHED}, NOW, 30, renew=True)
    *_, found = look_at_certificates(tmp_path, ["viewer-1"])
    assert found.problem is None


def test_routers_cannot_be_revoked(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {Member(ROUTER): REACHED}, NOW, 30)
    with pytest.raises(UserError, match=r"--revoke router: .*create a new authority in an empty folder"):
        revoke(tmp_path, "studio", [Member(ROUTER)], NOW)
    assert known(tmp_path).number == 0


def test_revoking_needs_the_key_of_the_authority(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"authority\.pem: missing: run this where the authority was made"):
        revoke(tmp_path, "studio", [ONE], NOW)
    certify(tmp_path, "studio", {ONE: REACHED}, NOW, 30)
    (tmp_path / "authority-key.pem").unlink()
    with pytest.raises(UserError, match=r"authority-key\.pem: missing"):
        revoke(tmp_path, "studio", [ONE], NOW)


def test_where_the_key_of_the_authority_is_certificates_that_expire_are_renewed_for_their_hosts(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: REACHED}, NOW, 40)
    certify(tmp_path, "studio", {TWO: REACHED}, NOW, 300)
    members = [ONE, TWO, Member("reader")]  # the last has no certificate here
    assert renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=5)) == []
    (made,) = renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=10))
    assert (made.member, made.done, set(made.hosts)) == (ONE, "renewed", set(REACHED))
    (made,) = renew_expiring(tmp_path, "studio", [TWO], NOW + timedelta(days=301))  # expired already
    assert made.member == TWO
    (tmp_path / "authority-key.pem").unlink()
    assert renew_expiring(tmp_path, "studio", members, NOW + timedelta(days=3000)) == []


def test_only_certificates_that_expire_soon_are_renewed_on_a_schedule(tmp_path: Path) -> None:
    certify(tmp_path, "studio", {ONE: REACHED}, NOW, 30)
    certify(tmp_path, "studio", {TWO: REACHED}, NOW, 300)
    later, month = NOW + timedelta(days=10), timedelta(days=30)
    made = certify(tmp_path, "studio", {ONE: REACHED[:1], TWO: REACHED}, later, 365, renew_within=month)
    assert [(one.member, one.done) for one in made] == [(ONE, "renewed"), (TWO, "kept")]
    assert made[0].ends == later + timedelta(days=365)
    assert set(made[0].hosts) == set(REACHED)  # also those that were given when it was made
